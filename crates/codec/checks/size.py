"""Adds up symbol sizes by module: `llvm-nm --print-size --demangle PROGRAM | size.py GOAL LIMIT`."""

import sys

MODULES = ["isu::eeprom", "isu", "t7", "ascii", "pwm", "angle", "stream", "checks", "bytes"]

goal, limit = (int(argument) for argument in sys.argv[1:])
sizes = dict.fromkeys(MODULES, 0)
helpers = 0
for line in sys.stdin:
    parts = line.split(None, 3)
    if len(parts) < 4:
        continue
    size, name = int(parts[1], 16), parts[3]
    if "clino_codec_nopanic" in name:
        continue
    module = next((module for module in MODULES if f"clino_codec::{module}::" in name.replace("..", "::")), None)
    if module:
        sizes[module] += size
    elif "clino_codec" in name:
        sizes["bytes"] += size
    else:
        helpers += size

total = sum(sizes.values())
for module, size in sizes.items():
    print(f"size: {size:6} B  {module}")
print(f"size: {total:6} B  the whole codec (goal {goal} B: {'met' if total <= goal else 'missed'}; limit {limit} B)")
print(f"size: {helpers:6} B  helpers of the compiler and of core (64-bit division, memory copies), shared with others")
sys.exit(not 0 < total <= limit)
