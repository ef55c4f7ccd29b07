"""Every number of docs/modbus.csv, one by one: it is there, is what its row says it is, and nothing else is.

Usage: map.py PORT CONSOLE CSV SLOT:ANGLE:TOLERANCE... ADDRESS:ANGLE:TOLERANCE. Needs pymodbus, and nothing of clino.
"""
import math
import re
import sys
import time

from master import ILLEGAL_ADDRESS, Master, refusal, value, wait, words
from terminal import Console, truth

FAST = 115_200

master, console = Master(sys.argv[1], sys.argv[3]), Console(sys.argv[2])
slots, _ = truth(sys.argv[4:])
# Where docs/modbus.md says that there is something.
BLOCKS = [(0, 0xE0), (0x100, 0x700), (0x700, 0x790), (0x800, 0x8C0), (0x900, 0x1600),
          (0x1800, 0x1820), (0x1840, 0x1860), (0x1900, 0x1F10), (0x2000, 0x2600)]
# What begins to count at reset, or has codes: the most it can be.
MOST = {"status": 14, "kind": 3, "last_error": 14, "set_kind": 3, "last_command": 24, "command_outcome": 4}


def at_full_speed():
    """By the port's own settings: the answer still comes as before, what follows is faster."""
    global master
    master.put("port_baud", FAST)
    master.client.close()
    master = Master(sys.argv[1], sys.argv[3], baud=FAST)
    assert master.get("port_baud") == FAST


def row_is_true(row):
    """Its value is one of its type's, within its limits, and whatever else its row says."""
    address, count = int(row["address_hex"], 16), int(row["registers"])
    assert int(row["register"]) == address + 1, row
    assert count == (1 if row["type"] in ("uint16", "int16") else 2), row
    number = value(row, master.read(address, count))
    name = row["name"]
    if number is None:
        assert row["invalid"], row
        return None
    assert not (isinstance(number, float) and math.isnan(number)), (row, "not the NaN of the list")
    assert int(row["address"]) == address, row
    # The registers of a command are not kept.
    slot = re.match(r"slot(\d+)_", name)
    kept = row["access"] == "rw"
    assert (row["access"] == "w") == (name.startswith("command") and row["least"] != "" or name == "arm_key"), row
    if row["access"] == "w":
        assert number == 0, (row, number)
    # The settings of an unused slot do not matter.
    if kept and (not slot or int(slot[1]) in slots):
        assert int(row["least"]) <= number <= int(row["most"]), (row, number)
    plain = re.sub(r"^slot\d+_|_\d+$", "", name)
    assert number <= MOST.get(plain, number), (row, number)
    if row["unit"] == "deg" and name.find("angle") >= 0:
        turn = 360 / float(row["scale"])
        assert -turn / 2 <= number < turn, (row, number)
    if row["values"] and "0x" not in row["values"]:
        codes = [int(code.split("=")[0]) for code in row["values"].split("|")]
        assert number in codes + [0], (row, number)
    always = re.search(r"(?:always|:) 0x([0-9A-Fa-f]{8}|[0-9A-Fa-f]{4})\b", row["description"])
    if always or row["description"].startswith("always"):
        raw = words(row, number)
        shown = re.search(r"0x([0-9A-Fa-f]+)", row["description"])
        assert int.from_bytes(b"".join(word.to_bytes(2, "big") for word in raw), "big") == int(shown[1], 16), row
    return number


def what_is_in_no_row():
    """Within a block it reads 0, elsewhere it is refused."""
    named = {int(row["address_hex"], 16) + i for row in master.rows for i in range(int(row["registers"]))}
    in_blocks = {address for first, end in BLOCKS for address in range(first, end)}
    assert named <= in_blocks, sorted(map(hex, named - in_blocks))
    gaps = sorted(in_blocks - named)
    for address in gaps[::17]:
        assert master.read(address, 1) == [0], hex(address)
    for first, end in BLOCKS:
        for address in (first - 1, end):
            if 0 <= address <= 0xFFFF and address not in in_blocks:
                assert refusal(lambda: master.read(address, 1)) == ILLEGAL_ADDRESS, hex(address)


began = time.monotonic()
# A user at the console ends its stream of readings, which is most of the board's work.
console.prompt()
wait(lambda: master.get("slots_ok") == len(slots))
at_full_speed()
found, wrong = {}, []
for row in master.rows:
    try:
        found[row["name"]] = row_is_true(row)
    except AssertionError as error:
        wrong.append(error)
assert not wrong, "\n".join(map(str, [f"{len(wrong)} of {len(master.rows)}", *wrong]))
assert len(found) == len(master.rows) > 2000, len(found)
assert found["slots_enabled"] == len(slots) and found["magic"] == 0x494E434C
# Slots in use have their angles in every copy; slots that are not have none in any.
for slot in range(48):
    copies = [found[name] for name in (f"angle_{slot:02}", f"slot{slot:02}_angle_deg", f"angle_i16_{slot:02}",
                                       f"angle_f32_{slot:02}", f"angle_f32_cdab_{slot:02}")]
    assert all((copy is not None) == (slot in slots) for copy in copies), (slot, copies)
what_is_in_no_row()
print(f"{len(found)} numbers one by one, {time.monotonic() - began:.0f} s")
