#!/bin/sh
# Flash that a driver takes on an STM32F411 above an empty program, with `opt-level = "s"` and no text. Fails above the goal;
# `size.sh --ratchet` fails only when a program has grown beyond what it was last accepted at. No 64-bit division in any.
#
# What takes it is in `docs/drivers.md`.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

# The goals, and what was accepted last, bytes.
goal_t7=8192 ratchet_t7=10400
goal_isu=8192 ratchet_isu=10100
goal_both=12288 ratchet_both=16000

target=thumbv7em-none-eabihf
rustup target add "$target" >/dev/null 2>&1 || true
cd "$crate/size"
export CARGO_TARGET_DIR="$CARGO_TARGET_DIR/examples"
cargo build --quiet --release --locked

text() { flash_of "$CARGO_TARGET_DIR/$target/release/$1"; }
# Each in an assignment of its own: elsewhere a failure would not end this.
empty=$(text empty)
hal=$(text hal)
echo "driver-size: $empty B  an empty program; $((hal - empty)) B more with the HAL's UART, pin and clocks in use"
nm=$(find "$(rustc --print sysroot)" -name llvm-nm -type f | head -n 1)
failed=
for program in t7 isu both; do
    eval "goal=\$goal_$program limit=\$ratchet_$program"
    whole=$(text "$program")
    size=$((whole - empty))
    met=missed
    [ "$size" -gt "$goal" ] || met=met
    [ "${1:-}" = --ratchet ] || limit=$goal
    echo "driver-size: $size B  $program above the empty program (goal $goal B: $met; limit $limit B)"
    [ "$size" -le "$limit" ] || failed=1
    if "$nm" "$CARGO_TARGET_DIR/$target/release/$program" | grep -E '(uldivmod|ldivmod|udivmoddi4|u64_div_rem)'; then
        echo "driver-size: $program divides 64 bits" >&2
        failed=1
    fi
done
[ -z "$failed" ]
