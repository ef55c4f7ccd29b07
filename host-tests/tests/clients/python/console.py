"""A logger, a person and a program at the gateway's console.

Usage: console.py PORT SLOT:ANGLE:TOLERANCE... ADDRESS:ANGLE:TOLERANCE. Needs pyserial, and nothing of clino.
"""
import re
import sys
import time

from terminal import PROMPT, Console, angle_of, away, truth

console = Console(sys.argv[1])
slots, (spare, spare_angle, spare_tolerance) = truth(sys.argv[2:])


def logger_reads_the_stream():
    """A logger types nothing, and sees every slot's angle."""
    console.until(b"\n")
    seen = {}
    while len(seen) < len(slots):
        line = console.object()
        if "slot" not in line or line["status"] != "ok":
            continue
        true, tolerance = slots[line["slot"]]
        assert away(line["angle_deg"], true) <= tolerance, (line, true)
        assert 0 <= line["age_ms"] < 10_000, line
        seen[line["slot"]] = line["kind"]
    assert list(map(seen.get, sorted(seen))) == ["t7", "t7", "t7", "isu", "pwm", "pwm"], seen


def person_gets_a_prompt_and_help():
    console.prompt()
    text = "\n".join(console.person("help"))
    for command in ["list", "read", "watch", "json", "slot", "bus", "t7", "isu", "counters", "save", "zero", "version"]:
        assert re.search(rf"^{command} ", text, re.M), (command, text)


def person_lists_the_slots():
    head, *rows = console.rows()
    assert head.split()[:4] == ["slot", "kind", "addr", "angle"], head
    angles = dict(map(angle_of, rows))
    assert angles.keys() == slots.keys(), rows
    for slot, (true, tolerance) in slots.items():
        assert angles[slot] is not None and away(angles[slot], true) <= tolerance, (rows, true)


def person_is_told_value_and_limit():
    for command, answer in [
        ("read 99", "error: slot 99 is not between 0 and 47"),
        ("bus t7 -g 20001", "error: guard_us 20001 is not between 0 and 20000"),
        ("bus t7 -b 300", "error: 300 bit/s is not among 115200 57600 38400 19200 9600"),
        ("slot 1 tape 1", "error: tape: expected off, t7, isu or pwm"),
        ("nonsense", "error: unknown command, try help"),
    ]:
        assert answer in console.person(command), command


def person_watches_and_stops():
    console.line.write(b"watch\r")
    for _ in range(10):
        console.until(b"\n")
    console.line.write(b"\x03")
    console.until(PROMPT)


def person_stops_a_long_operation():
    """A scan at all bit rates reports its progress and ends when it is cancelled."""
    began = time.monotonic()
    console.line.write(b"t7 scan all\r")
    console.until(b"under way: done ")
    console.line.write(b"\x03")
    text = console.until(PROMPT).decode()
    swept = re.search(r"swept: devices \d+, suspects \d+, asked (\d+), complete no\r\n", text)
    assert swept and int(swept[1]) < 505, text
    print(f"scan stopped after {time.monotonic() - began:.1f} s")


def person_scans_reads_and_zeroes_a_sensor():
    found = [line for line in console.task("t7 scan", "swept: ") if line.startswith("found: ")]
    addresses = sorted(int(re.match(r"found: address (\d+), baud 115200,", line)[1]) for line in found)
    assert addresses == [1, 2, 3, spare], found
    assert console.person(f"slot 2 t7 {spare}") == ["done"]
    wait_for(2, spare_angle, spare_tolerance)
    zeroed, = [line for line in console.task(f"t7 zero {spare}", "zeroed: ", sure=True) if line.startswith("zeroed: ")]
    assert f"before_mdeg {round(spare_angle * 1000)}, after_mdeg 0, " in zeroed, zeroed
    wait_for(2, 0, spare_tolerance)


def person_saves():
    """The settings are stored, once."""
    assert console.person("save") == ["saved: stored written"]
    assert console.person("save") == ["saved: stored unchanged"]


def program_speaks_json():
    version = console.speak_json()
    assert re.fullmatch(r"\d+\.\d+\.\d+", version["version"]), version
    for slot in slots:
        if slot != 2:
            reading, (true, tolerance) = console.program(f"read {slot}"), slots[slot]
            # Storing has stopped the polls for the time of an erase: an answer may have been lost in it.
            deadline = time.monotonic() + 5
            while reading["status"] != "ok" and time.monotonic() < deadline:
                reading = console.program(f"read {slot}")
            assert (reading["slot"], reading["status"]) == (slot, "ok"), reading
            assert away(reading["angle_deg"], true) <= tolerance, (reading, true)
    for command, error in [
        ("read 48", {"kind": "out_of_range", "what": "slot", "value": 48, "least": 0, "most": 47}),
        ("slot 1 isu 15", {"kind": "out_of_range", "what": "address", "value": 15, "allowed": "1 to 14, or 0 if it is alone"}),
        ("read x", {"kind": "bad_argument", "what": "slot", "value": "x", "least": 0, "most": 47}),
        ("nonsense", {"kind": "unknown_command"}),
    ]:
        assert console.program(command) == {"error": error}, command
    later = console.program("version")
    assert later["uptime_ms"] > version["uptime_ms"], (version, later)
    console.line.write(b"json off\r")
    console.until(PROMPT)


def wait_for(slot, true, tolerance):
    """The slot shows that angle, before long."""
    deadline = time.monotonic() + 120
    while True:
        row = console.row(slot)
        angle = angle_of(row)[1]
        if angle is not None and away(angle, true) <= tolerance:
            return
        assert time.monotonic() < deadline, (row, true)


logger_reads_the_stream()
person_gets_a_prompt_and_help()
person_lists_the_slots()
person_is_told_value_and_limit()
person_watches_and_stops()
person_stops_a_long_operation()
person_scans_reads_and_zeroes_a_sensor()
person_saves()
program_speaks_json()
