#!/bin/sh
# Runs every fuzz target, on its checked-in corpus first: `fuzz.sh [SECONDS [SEED]]`, 30 seconds each by default.
# The daily run always begins the same way, so that what it finds is the change's fault; the campaign takes a
# seed of its own each time (0).
set -eu
cd "$(dirname "$0")/../.."
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"

seconds=${1:-30}
seed=${2:-1}
cargo fuzz --version >/dev/null 2>&1 || cargo install cargo-fuzz --quiet

targets=$(cargo +nightly fuzz list)
# Other people's crates as they are in the image: some of them print a lot where `fuzzing` is set.
cargo +nightly fuzz build --sanitizer address --no-cfg-fuzzing
fuzz() {
    log=$CARGO_TARGET_DIR/fuzz-$1.log
    # New finds stay out of the checked-in corpus.
    finds=$(mktemp -d)
    if ! cargo +nightly fuzz run --no-cfg-fuzzing "$1" "$finds" "fuzz/corpus/$1" -- \
        -seed="$seed" -max_total_time="$seconds" -max_len=1024 -verbosity=0 -print_final_stats=1 >"$log" 2>&1; then
        tail -40 "$log" >&2
        echo "fuzz: $1 failed" >&2
        exit 1
    fi
    rm -r "$finds"
    echo "fuzz: $1, $(awk '/number_of_executed_units/ { print $2 }' "$log") executions in $seconds s, no finding"
}

# Two at a time: a target keeps one core busy.
other=
for target in $targets; do
    fuzz "$target" &
    if [ -n "$other" ]; then
        wait "$other"
    fi
    other=$!
done
wait "$other"
