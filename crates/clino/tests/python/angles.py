"""Reads an angle from a T7 and one from an ISU, and prints them in degrees.

Usage: angles.py T7_PORT T7_ADDRESS ISU_PORT ISU_ADDRESS. Needs pyserial, and nothing of clino.
"""
import sys

import serial


def t7_angle(port, address):
    with serial.Serial(port, 115200, timeout=20) as line:
        line.write(bytes([address, 1, 0x83]))
        answer = line.read(8)
    assert answer[:3] == bytes([address, 6, 0x83]) and sum(answer) % 256 == 0, answer.hex(" ")
    return int.from_bytes(answer[3:7], "big", signed=True) / 1000


def isu_angle(port, address):
    body = bytes([address << 4 | 4, 0x58, 2])
    with serial.Serial(port, 9600, timeout=20) as line:
        line.write(bytes([3]) + body + bytes([sum(body) % 256]))
        answer = line.read(6)
    assert answer[:3] == bytes([4, body[0] | 1, 0x58]) and sum(answer[1:5]) % 256 == answer[5], answer.hex(" ")
    return int.from_bytes(answer[3:5], "big") * 360 / 65536


print(t7_angle(sys.argv[1], int(sys.argv[2])))
print(isu_angle(sys.argv[3], int(sys.argv[4])))
