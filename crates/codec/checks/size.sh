#!/bin/sh
# Flash that the codec takes on a Cortex-M4 at opt-level "s", part by part, when every public function is kept whole.
# Fails above the goal. `size.sh --ratchet` fails only when the codec has grown beyond what it was last accepted at.
set -eu
. "$(dirname "$0")/common.sh"
needs python3

goal=4096
ratchet=13700
limit=$goal
[ "${1:-}" != --ratchet ] || limit=$ratchet

target=thumbv7em-none-eabihf
rustup component add llvm-tools >/dev/null 2>&1
tools=$(dirname "$(find "$(rustc --print sysroot)" -name llvm-nm -type f | head -n 1)")
cd "$crate/nopanic"
bare_metal_build "$target"
"$tools/llvm-nm" --print-size --demangle "$CARGO_TARGET_DIR/$target/release/clino-codec-nopanic" |
    python3 "$here/size.py" "$goal" "$limit"
