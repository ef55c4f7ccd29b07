#!/bin/sh
# The tool builds for the other systems: Windows and macOS. Only the compiler looks: nothing is linked or run there. Their parts
# of `port/serial.rs`, and of the libraries, are not tested by this.
#
# Without `serve` and `bridge`: their TLS has a part in C, which wants a C compiler for each system. They are checked by the
# tests of this one.
#
# A target that cannot be had (no rustup, no network) is skipped, loudly; a target that is there and does not build fails.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"
cd "$root"
built=0
for target in x86_64-pc-windows-gnu aarch64-apple-darwin; do
    if ! rustup target list --installed 2>/dev/null | grep -qx "$target" && ! rustup target add "$target" >/dev/null 2>&1; then
        skipped "systems: $target is not installed, and rustup cannot have it; clino is not checked for it"
        continue
    fi
    RUSTFLAGS="-D warnings" cargo check --quiet -p clino --bins --no-default-features --target "$target" --target-dir "$CARGO_TARGET_DIR/systems"
    built=$((built + 1))
done
echo "clino builds for $built of 2 other systems"
