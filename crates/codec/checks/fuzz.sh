#!/bin/sh
# Runs every fuzz target, on its checked-in corpus first: `fuzz.sh [SECONDS]` each, 30 by default.
set -eu
. "$(dirname "$0")/common.sh"

seconds=${1:-30}
cargo fuzz --version >/dev/null 2>&1 || cargo install cargo-fuzz --quiet

cd "$root"
targets=$(cargo +nightly fuzz list)
cargo +nightly fuzz build --sanitizer address
for target in $targets; do
    log=$CARGO_TARGET_DIR/fuzz-$target.log
    # New finds stay out of the checked-in corpus.
    finds=$(mktemp -d)
    if ! cargo +nightly fuzz run "$target" "$finds" "fuzz/corpus/$target" -- \
        -max_total_time="$seconds" -max_len=1024 -verbosity=0 -print_final_stats=1 >"$log" 2>&1; then
        tail -40 "$log" >&2
        echo "fuzz: $target failed" >&2
        exit 1
    fi
    rm -r "$finds"
    echo "fuzz: $target, $(awk '/number_of_executed_units/ { print $2 }' "$log") executions in $seconds s, no finding"
done
