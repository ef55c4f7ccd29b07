"""Reads a gateway with minimalmodbus, and sets up a slot. Arguments and output: strangers.rs.

minimalmodbus has no functions 08 and 43 of its own; it takes any function, and their answers end with its timeout.
"""
import sys

import minimalmodbus

SLOTS = 6
angles, ages, floats, cdab, counter, settings, spare = map(int, sys.argv[2:])
master = minimalmodbus.Instrument(sys.argv[1], 1)
master.serial.baudrate, master.serial.timeout = 19200, 60


def each(read, address, step):
    return [read(address + step * slot) for slot in range(SLOTS)]


def angle(address):
    return master.read_long(address, signed=True)


swapped = minimalmodbus.BYTEORDER_LITTLE_SWAP
for _ in range(100):
    shown = each(angle, angles, 2)
    if -0x80000000 not in shown:
        break
print("angles", *shown)
print("ages", *each(master.read_register, ages, 1))
print("floats", *each(master.read_float, floats, 2))
for order in (minimalmodbus.BYTEORDER_LITTLE, swapped, minimalmodbus.BYTEORDER_BIG_SWAP, minimalmodbus.BYTEORDER_BIG):
    # Registers CD AB: bytes in the usual order, registers swapped. Its name differs between versions.
    values = each(lambda address: master.read_float(address, byteorder=order), cdab, 2)
    if abs(values[0] - master.read_float(floats)) < 1e-3:
        print("cdab", *values)
        break
print("counter", master.read_long(counter))
# No more than a frame: what is asked for next comes after it.
master.serial.timeout = 5
answer = master._perform_command(43, b"\x0e\x02\x00")
at = 6
for _ in range(answer[5]):
    number, length = answer[at:at + 2]
    print("object", number, answer[at + 2:at + 2 + length].decode())
    at += 2 + length
answer = master._perform_command(8, b"\x00\x0b\x00\x00")
print("messages", int.from_bytes(answer[2:4], "big"))
master.serial.timeout = 60
master.write_registers(settings, [1, 1, spare])
for _ in range(300):
    shown = angle(angles + 2 * SLOTS)
    if shown != -0x80000000:
        break
print("set_up", shown)
master.write_register(settings, 0, functioncode=6)
