"""A terminal on the gateway's console, and the truth that the tests hand over.

Needs pyserial, and nothing of clino. Waits are generous: the virtual board may be slower than real time.
"""
import json
import re
import time

import serial

PROMPT = b"clino> "
# Seconds without a byte, and in all.
SILENCE, PATIENCE = 60, 600


class Console:
    def __init__(self, path):
        self.line = serial.Serial(path, 115200, timeout=1)

    def until(self, end):
        """Everything up to and with `end`."""
        heard, began = b"", time.monotonic()
        last = began
        while not heard.endswith(end):
            byte, now = self.line.read(1), time.monotonic()
            heard, last = heard + byte, now if byte else last
            assert now < last + SILENCE and now < began + PATIENCE, f"no {end!r} after {heard[-4096:]!r}"
        return heard

    def prompt(self):
        """Becomes a person, whatever it was before."""
        self.line.write(b"\x03\rversion\r")
        self.until(b"uptime_ms")
        self.until(PROMPT)

    def uptime(self):
        """Milliseconds since reset."""
        return int(re.search(r"uptime_ms (\d+)", "\n".join(self.person("version")))[1])

    def speak_json(self):
        """Becomes a program; what it says of its version."""
        self.line.write(b"json on\rversion\r")
        self.until(b'{"what":"clino"')
        return json.loads(b'{"what":"clino"' + self.until(b"\n"))

    def person(self, command):
        """Types a command; the lines between the command and the next prompt."""
        self.line.write(command.encode() + b"\r")
        text = self.until(PROMPT).decode("ascii")
        lines = [line.strip() for line in text.split("\r\n")]
        assert command in lines[0], f"{command!r} is not echoed: {text!r}"
        return lines[1:-1]

    def task(self, command, last, sure=False):
        """Types a command that takes its time; what it says up to the line that begins with `last`. `sure`: it writes
        to a sensor's memory, asks for confirmation, and takes it."""
        self.line.write(command.encode() + b"\r")
        if sure:
            self.until(b"y/N ")
            self.line.write(b"y\r")
        text = self.until(last.encode()) + self.until(b"\n")
        self.until(PROMPT)
        # Progress is written over.
        return [line.split("\x1b[K")[-1].strip() for line in text.decode("ascii").split("\n")]

    def row(self, slot):
        """The row of a slot in the list."""
        row, = [row for row in self.rows()[1:] if angle_of(row)[0] == slot]
        return row

    def rows(self):
        """The list, its head first, without what is wrong with the gateway behind it."""
        return [row for row in self.person("list") if not row.startswith("signals: ")]

    def object(self):
        """The next line: a JSON object, with no number that is none."""
        text = self.until(b"\n").decode("ascii")
        found = json.loads(text, parse_constant=lambda constant: None)
        assert isinstance(found, dict) and "NaN" not in text and "Infinity" not in text, text
        return found

    def program(self, command):
        """Sends a command; the first line of the answer."""
        self.line.write(command.encode() + b"\r")
        return self.object()


def truth(arguments):
    """Angle and tolerance by slot, and those of the T7 that no slot reads with its address."""
    numbers = [argument.split(":") for argument in arguments]
    known = [(int(number), float(angle), float(tolerance)) for number, angle, tolerance in numbers]
    return {slot: rest for slot, *rest in known[:-1]}, known[-1]


def away(angle, true):
    """Distance of two angles, the short way around."""
    return abs((angle - true + 180) % 360 - 180)


def angle_of(row):
    """Slot and angle in a row of `list`; no angle if the slot has none."""
    found = re.match(r"(\d+)\s+(\w+)\s+(\d+|-)\s+(-?\d+\.\d{3}|-)\s", row)
    assert found, row
    return int(found[1]), None if found[4] == "-" else float(found[4])
