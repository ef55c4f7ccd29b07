#!/bin/sh
# Flash that a driver takes on an STM32F411 above an empty program, with `opt-level = "s"` and no text. Fails above the limits.
# No 64-bit division in any.
#
# What takes it is in `docs/drivers.md`.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

# Bytes. `most` are limits for good; what `many-nodes` adds may grow no further.
most_t7=8192 many_t7=8900
most_isu=8192 many_isu=8900
most_both=12288 many_both=13450

target=thumbv7em-none-eabihf
rustup target add "$target" >/dev/null 2>&1 || true
cd "$crate/size"
export CARGO_TARGET_DIR="$CARGO_TARGET_DIR/examples"
nm=$(find "$(rustc --print sysroot)" -name llvm-nm -type f | head -n 1)
failed=

text() { flash_of "$CARGO_TARGET_DIR/$target/release/$1"; }

# The programs, built with these features, against the limits of that name.
measure() {
    limits=$1 what=$2
    shift 2
    cargo build --quiet --release --locked "$@"
    # Each in an assignment of its own: elsewhere a failure would not end this.
    empty=$(text empty)
    for program in t7 isu both; do
        eval "limit=\$${limits}_$program"
        whole=$(text "$program")
        size=$((whole - empty))
        echo "driver-size: $size B  $program$what above the empty program (limit $limit B)"
        [ "$size" -le "$limit" ] || failed=1
        if "$nm" "$CARGO_TARGET_DIR/$target/release/$program" | grep -E '(uldivmod|ldivmod|udivmoddi4|u64_div_rem)'; then
            echo "driver-size: $program divides 64 bits" >&2
            failed=1
        fi
    done
}

measure many ", feature many-nodes," --features many-nodes
measure most ""
hal=$(text hal)
echo "driver-size: $empty B  an empty program; $((hal - empty)) B more with the HAL's UART, pin and clocks in use"
[ -z "$failed" ]
