#!/bin/sh
# No panic is reachable from any public entry point: the probe program links only if that is so.
# Shows first that the check can fail, by planting a panic.
set -eu
. "$(dirname "$0")/common.sh"

target=thumbv7em-none-eabihf
cd "$crate/nopanic"

if bare_metal_build "$target" --features planted 2>"$CARGO_TARGET_DIR/nopanic-planted.log"; then
    echo "nopanic: a planted panic was not noticed" >&2
    exit 1
fi
if ! grep -q "undefined symbol: a_panic_is_reachable" "$CARGO_TARGET_DIR/nopanic-planted.log"; then
    cat "$CARGO_TARGET_DIR/nopanic-planted.log" >&2
    echo "nopanic: the planted panic failed to build for another reason" >&2
    exit 1
fi
if ! bare_metal_build "$target"; then
    echo "nopanic: a panic is reachable" >&2
    exit 1
fi
echo "nopanic: 0 reachable panics on $target (a planted one is noticed)"
