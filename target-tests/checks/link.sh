#!/bin/sh
# The tests for a real chip build and link, and every one is in its program for probe-rs to find.
set -eu
cd "$(dirname "$0")/.."
rustup target add thumbv7em-none-eabihf >/dev/null 2>&1
CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-../target}/target-tests"
export CARGO_TARGET_DIR
programs=$(cargo test --release --no-run --message-format short 2>&1) || { echo "$programs"; exit 1; }
count=0
for source in tests/*.rs; do
    name=$(basename "$source" .rs)
    program=$(echo "$programs" | sed -n "s|.*Executable $source (\(.*\))|\1|p")
    [ -n "$program" ] || { echo "target-tests: $source has no program"; exit 1; }
    for test in $(sed -n '/#\[test\]/,/fn /s/^ *fn \([a-z_0-9]*\)(.*/\1/p' "$source"); do
        grep -q "$test" "$program" || { echo "target-tests: $test is not in $name"; exit 1; }
        count=$((count + 1))
    done
done
[ "$count" -gt 0 ] || { echo "target-tests: there are none"; exit 1; }
echo "target-tests: $count tests in $(echo tests/*.rs | wc -w) programs are linked"
