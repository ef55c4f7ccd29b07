#!/bin/sh
# The example programs build for their boards, as they are in the repository: all, or those named.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

[ $# -gt 0 ] || set -- f411-nb rp2040-embassy esp32c3 linux-serial
for example in "$@"; do
    begun=$(date +%s)
    cd "$root/examples/$example"
    target=$(sed -n 's/^target = "\(.*\)"$/\1/p' .cargo/config.toml 2>/dev/null || true)
    [ -z "$target" ] || rustup target add "$target" >/dev/null 2>&1 || true
    CARGO_TARGET_DIR=$CARGO_TARGET_DIR/examples cargo build --quiet --release --locked
    lines=$(wc -l <src/main.rs)
    if [ "$lines" -ge 60 ]; then
        echo "examples: $example has $lines lines, and should have less than 60" >&2
        exit 1
    fi
    echo "examples: $example ($lines lines) builds, $(($(date +%s) - begun)) s"
done
