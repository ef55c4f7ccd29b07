"""64 KiB of garbage on the gateway's console: no reset, the same settings, and commands work afterwards.

Usage: flood.py PORT SLOT:ANGLE:TOLERANCE... ADDRESS:ANGLE:TOLERANCE. Needs pyserial, and nothing of clino.
"""
import random
import sys
import time

from terminal import Console, angle_of, away, truth

SIZE = 64 * 1024

console = Console(sys.argv[1])
slots, _ = truth(sys.argv[2:])


def settings():
    """What garbage must not change."""
    sources = [row.split()[:3] for row in console.rows()[1:]]
    return sources, [console.person(f"bus {bus}") for bus in ("t7", "isu")]


console.prompt()
before, was = console.uptime(), settings()
console.line.write_timeout = 120
garbage = random.Random(1).randbytes(SIZE)
for at in range(0, SIZE, 1024):
    console.line.write(garbage[at:at + 1024])
    # The answers are not checked; but they must not be lost for want of room either.
    console.line.read(console.line.in_waiting)
# What is typed behind it waits in the same queue, and is lost while the console writes more than it reads: until it is
# through, or the stream runs again.
began = heard = time.monotonic()
while time.monotonic() < min(heard + 3, began + 60):
    if console.line.read(max(1, console.line.in_waiting)):
        heard = time.monotonic()
# In case it ended within a quotation or an escape sequence, or as a program.
console.line.write(b"\r\x03\r\x03json off\r\r")
console.prompt()
after = console.uptime()
# It took that long to go over the line, eleven bits a byte counted generously: less than ten would be a reset.
assert after - before >= SIZE * 10 * 1000 // 115200, (before, after)
assert settings() == was, (settings(), was)
for slot, angle in map(angle_of, console.rows()[1:]):
    true, tolerance = slots[slot]
    assert angle is not None and away(angle, true) <= tolerance, (slot, angle, true)
print(f"uptime {before} ms before, {after} ms after")
