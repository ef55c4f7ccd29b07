"""Settings by Modbus: in force at once, seen at the console; refused whole, with the documented exceptions.

Usage: settings.py PORT CONSOLE CSV SLOT:ANGLE:TOLERANCE... ADDRESS:ANGLE:TOLERANCE. Needs pymodbus and pyserial.
"""
import random
import sys

import serial
from master import ARM_KEY, ILLEGAL_ADDRESS, ILLEGAL_FUNCTION, ILLEGAL_VALUE, Master, refusal, wait
from terminal import Console, away, truth

SAVE, SOFT_ZERO, SENSOR_ZERO = 1, 4, 16
DONE = 2

master, console = Master(sys.argv[1], sys.argv[3]), Console(sys.argv[2])
slots, (spare, spare_angle, _) = truth(sys.argv[4:])


def shows(slot, degrees):
    """Within what the steps of a sensor and of millidegrees leave open."""
    mdeg = master.get(f"angle_{slot:02}")
    return mdeg is not None and away(mdeg / 1000, degrees) < 0.002


def a_slot_reads_another_sensor():
    """In force at once, and people see it."""
    wait(lambda: shows(1, slots[1][0]))
    master.write_one(master.address("slot01_set_address"), spare)
    wait(lambda: shows(1, spare_angle))
    console.prompt()
    row = console.row(1)
    assert row.split()[:4] == ["1", "t7", str(spare), f"{spare_angle:.3f}"], row
    assert master.get("slot01_address") == spare


def a_slot_that_was_not_in_use_is_set_up():
    """Enabled, kind, address and axis in one request; the rest is what is usual."""
    unused = len(slots)
    assert master.get(f"slot{unused:02}_set_kind") == 0
    master.write(master.address(f"slot{unused:02}_enabled"), [1, 1, spare, 2])
    wait(lambda: shows(unused, spare_angle))
    assert master.get("slots_enabled") == len(slots) + 1
    # And as one block, as it was read: nothing changes.
    first = master.address(f"slot{unused:02}_enabled")
    block = master.read(first, 17)
    master.write(first, block)
    assert master.read(first, 17) == block
    master.write_one(first, 0)
    wait(lambda: master.get(f"angle_{unused:02}") is None)


def a_soft_zero_and_a_sense():
    before = master.settings()[0]
    wait(lambda: shows(0, slots[0][0]))
    master.put("slot00_zero", 2_345)
    wait(lambda: shows(0, slots[0][0] - 2.345))
    master.put("slot00_reversed", 1)
    wait(lambda: shows(0, 2.345 - slots[0][0]))
    # Several settings in one request, one of them beyond its limit: none is changed.
    address = master.address("slot00_reversed")
    assert refusal(lambda: master.write(address, [0, 0, 9])) == ILLEGAL_VALUE
    assert shows(0, 2.345 - slots[0][0])
    master.write(address, [0, 0, 0])
    master.put("slot00_zero", 0)
    wait(lambda: shows(0, slots[0][0]))
    assert master.settings()[0] == before
    sequence = master.get("command_sequence")
    master.command(SOFT_ZERO, target=0)
    wait(lambda: shows(0, 0))
    assert master.get("command_sequence") == sequence + 1
    assert master.get("slot00_zero") == round(slots[0][0] * 1000)


def what_is_refused():
    before = master.settings()
    client, address = master.client, master.address
    assert client.read_coils(0, count=1).exception_code == ILLEGAL_FUNCTION
    assert client.report_device_id().exception_code == ILLEGAL_FUNCTION
    for first, count in [(0x00E0, 1), (0x00DF, 2), (0x15FF, 2), (0x7FFF, 1), (0xFFFF, 1)]:
        assert refusal(lambda: master.read(first, count)) == ILLEGAL_ADDRESS, hex(first)
    for name, number in [
        ("slot02_enabled", 2), ("slot02_set_kind", 4), ("slot02_set_address", 128), ("slot02_set_retries", 11),
        ("slot02_stale", 9), ("slot02_zero", 360_001), ("bus0_guard", 20_001), ("port_address", 248),
        ("port_baud", 12_345), ("bus1_baud", 19_200),
    ]:
        assert refusal(lambda: master.put(name, number)) == ILLEGAL_VALUE, (name, number)
    # Not writable; half of a number; a command without its code; two slots at once.
    assert refusal(lambda: master.write_one(address("uptime"), 0)) == ILLEGAL_ADDRESS
    assert refusal(lambda: master.write_one(address("slot02_zero"), 0)) == ILLEGAL_ADDRESS
    assert refusal(lambda: master.write(address("slot02_zero") + 1, [0])) == ILLEGAL_ADDRESS
    assert refusal(lambda: master.write_one(address("command_target"), 0)) == ILLEGAL_ADDRESS
    # What wears a sensor's memory takes the key.
    for key in (0, ARM_KEY + 1):
        assert refusal(lambda: master.command(SENSOR_ZERO, target=2, key=key)) == ILLEGAL_VALUE
    assert refusal(lambda: master.command(99)) == ILLEGAL_VALUE
    assert master.settings() == before
    assert master.get("slot02_nv_writes") == 0


def with_the_key_the_sensor_is_zeroed():
    """The T7 at the spare address, which slot 1 reads."""
    master.command(SENSOR_ZERO, target=1, key=ARM_KEY)
    wait(lambda: master.get("command_outcome") == DONE)
    assert master.get("last_command") == SENSOR_ZERO
    wait(lambda: shows(1, 0))
    assert master.get("arm_key") == 0


def a_broadcast_is_carried_out_and_not_answered():
    # Slot 3 is not touched otherwise. The frame is what pymodbus makes of it; the silence is seen on the line itself.
    master.client.write_register(master.address("slot03_set_retries"), 7, device_id=0, no_response_expected=True)
    line: serial.Serial = master.client.socket
    patience, line.timeout = line.timeout, 1
    assert line.read(1) == b""
    line.timeout = patience
    assert master.get("slot03_set_retries") == 7
    assert int(master.checked(master.client.diag_read_device_no_response_count()).message) >= 1


def random_bytes_change_nothing():
    before = master.settings()
    errors = lambda: int(master.checked(master.client.diag_read_bus_comm_error_count()).message)
    heard, some = errors(), random.Random(2)
    line: serial.Serial = master.client.socket
    patience = line.timeout
    console.prompt()
    began, sent, answered = console.uptime(), 0, b""
    for _ in range(40):
        burst = some.randbytes(some.randrange(1, 100))
        line.write(burst)
        sent += len(burst)
        # A pause now and then, so that some of them are frames of their own.
        line.timeout = some.choice([0, 0.05])
        answered += line.read(10)
    line.timeout = patience
    # Until they are over the line, by the gateway's own clock, and half a second more.
    while console.uptime() < began + sent * 11 * 1000 // 19200 + 500:
        answered += line.read(line.in_waiting)
    assert answered == b"", answered
    assert errors() > heard, "they were heard"
    assert master.settings() == before
    assert master.get("uptime") >= console.uptime() // 1000 - 1 >= began // 1000


a_slot_reads_another_sensor()
a_slot_that_was_not_in_use_is_set_up()
a_soft_zero_and_a_sense()
what_is_refused()
with_the_key_the_sensor_is_zeroed()
a_broadcast_is_carried_out_and_not_answered()
random_bytes_change_nothing()
