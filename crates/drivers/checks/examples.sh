#!/bin/sh
# The example programs build for their boards, as they are in the repository: all, or those named. One for each row of the
# table of HALs in the README of clino-drivers.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

[ $# -gt 0 ] || set -- $(ls "$root/examples")
for example in "$@"; do
    begun=$(date +%s)
    cd "$root/examples/$example"
    target=$(sed -n 's/^target = "\(.*\)"$/\1/p' .cargo/config.toml 2>/dev/null || true)
    [ -z "$target" ] || rustup target add "$target" >/dev/null 2>&1 || true
    CARGO_TARGET_DIR=$CARGO_TARGET_DIR/examples cargo build --quiet --release --locked
    programs=0
    for program in src/main.rs src/bin/*.rs; do
        [ -f "$program" ] || continue
        programs=$((programs + 1))
        lines=$(wc -l <"$program")
        if [ "$lines" -ge 60 ]; then
            echo "examples: $program of $example has $lines lines, and should have less than 60" >&2
            exit 1
        fi
        name=$(basename "$program" .rs)
        [ "$name" != main ] || name=$example
        size=$(flash_of "$CARGO_TARGET_DIR/examples/${target:+$target/}release/$name")
        echo "examples: $example, $name: $size bytes"
    done
    echo "examples: $example builds, programs: $programs, $(($(date +%s) - begun)) s"
done
