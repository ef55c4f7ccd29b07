"""A Modbus master on the gateway's port: stock pymodbus, with the numbers of docs/modbus.csv by name.

Needs pymodbus and pyserial, and nothing of clino.
"""
import csv
import struct
import time

from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient

FORMS = {"uint16": ">H", "int16": ">h", "uint32": ">I", "int32": ">i", "float32": ">f"}
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
ARM_KEY = 0x4E56
# Seconds: the virtual board may be much slower than real time on a busy computer.
PATIENCE = 20


class Refused(Exception):
    """An answer with an exception code."""


class Master:
    """Patient, and without retries, which would hide a fault.

    The line has even parity; but a pseudo-terminal knows nothing of it, and to pyserial that is an error if it is asked
    for: a port of a computer is opened with parity="E".
    """

    def __init__(self, path, csv_path, baud=19200):
        self.client = ModbusSerialClient(path, framer=FramerType.RTU, baudrate=baud, parity="N",
                                         timeout=PATIENCE, retries=0)
        assert self.client.connect()
        with open(csv_path, encoding="utf-8") as file:
            self.rows = list(csv.DictReader(file))
        self.by_name = {row["name"]: row for row in self.rows}
        assert len(self.by_name) == len(self.rows), "a name comes twice"

    def checked(self, answer):
        if answer.isError():
            raise Refused(answer.exception_code)
        return answer

    def read(self, address, count):
        return self.checked(self.client.read_holding_registers(address, count=count)).registers

    def write(self, address, words):
        self.checked(self.client.write_registers(address, words))

    def write_one(self, address, word):
        self.checked(self.client.write_register(address, word))

    def address(self, name):
        return int(self.by_name[name]["address_hex"], 16)

    def get(self, name):
        """A number by its name; `None` if it is the one that says there is none."""
        row = self.by_name[name]
        return value(row, self.read(self.address(name), int(row["registers"])))

    def put(self, name, number):
        """Writes a number by its name, whole."""
        row = self.by_name[name]
        self.write(self.address(name), words(row, number))

    def command(self, code, target=0, number=0, key=0):
        high, low = divmod(number & 0xFFFFFFFF, 1 << 16)
        self.write(self.address("command"), [code, target, high, low, key])

    def settings(self):
        """Everything that can be written, as it is read, and how many commands were accepted."""
        words = []
        for first, last in [(0x1000, 0x1600), (0x1800, 0x1820), (0x1840, 0x1850)]:
            for at in range(first, last, 96):
                words += self.read(at, min(96, last - at))
        return words, self.get("command_sequence")


def value(row, registers):
    """A number out of its registers, as its row says."""
    raw = raw_of(row, registers)
    if row["invalid"] and int.from_bytes(raw, "big") == int(row["invalid"], 16):
        return None
    return struct.unpack(FORMS[row["type"]], raw)[0]


def raw_of(row, registers):
    """High byte first, high word first."""
    assert len(registers) == int(row["registers"])
    order = registers[::-1] if row["byte_order"] == "CDAB" else registers
    assert row["byte_order"] in ("AB", "ABCD", "CDAB"), row
    return struct.pack(f">{len(order)}H", *order)


def words(row, number):
    raw = struct.pack(FORMS[row["type"]], number)
    return list(struct.unpack(f">{len(raw) // 2}H", raw))


def refusal(work):
    """The exception that it is answered with."""
    try:
        work()
    except Refused as refused:
        return refused.args[0]
    raise AssertionError("it was not refused")


def wait(what, patience=120):
    """Until it is so."""
    deadline = time.monotonic() + patience
    while not what():
        assert time.monotonic() < deadline, "it did not come"
