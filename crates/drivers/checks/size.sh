#!/bin/sh
# Flash that a driver takes on an STM32F411 above an empty program, with `opt-level = "s"` and no text. Fails above the goal;
# `size.sh --ratchet` fails only when a program has grown beyond what it was last accepted at. No 64-bit division in any.
#
# What takes it is in `docs/drivers.md`.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

# The goals, and what was accepted last, bytes.
goal_t7=8192 ratchet_t7=14200
goal_isu=8192 ratchet_isu=13700
goal_both=12288 ratchet_both=21600

target=thumbv7em-none-eabihf
rustup target add "$target" >/dev/null 2>&1 || true
rustup component add llvm-tools >/dev/null 2>&1 || true
tools=$(dirname "$(find "$(rustc --print sysroot)" -name llvm-size -type f | head -n 1)")
cd "$crate/size"
export CARGO_TARGET_DIR="$CARGO_TARGET_DIR/examples"
cargo build --quiet --release --locked

text() { "$tools/llvm-size" "$CARGO_TARGET_DIR/$target/release/$1" | awk 'NR == 2 { print $1 + $2 }'; }
empty=$(text empty)
[ "$empty" -gt 0 ] || {
    echo "driver-size: the programs are linked without a linker script: nothing of them is kept" >&2
    exit 1
}
echo "driver-size: $empty B  an empty program; $(($(text hal) - empty)) B more with the HAL's UART, pin and clocks in use"
failed=
for program in t7 isu both; do
    eval "goal=\$goal_$program limit=\$ratchet_$program"
    size=$(($(text "$program") - empty))
    met=missed
    [ "$size" -gt "$goal" ] || met=met
    [ "${1:-}" = --ratchet ] || limit=$goal
    echo "driver-size: $size B  $program above the empty program (goal $goal B: $met; limit $limit B)"
    [ "$size" -le "$limit" ] || failed=1
    if "$tools/llvm-nm" "$CARGO_TARGET_DIR/$target/release/$program" | grep -E '(uldivmod|ldivmod|udivmoddi4|u64_div_rem)'; then
        echo "driver-size: $program divides 64 bits" >&2
        failed=1
    fi
done
[ -z "$failed" ]
