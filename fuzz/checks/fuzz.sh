#!/bin/sh
# Runs every fuzz target, on its checked-in corpus first: `fuzz.sh [SECONDS [SEED]]`, 5 seconds each by default.
# The daily run always begins the same way, so that what it finds is the change's fault; the campaign takes a
# seed of its own each time (0), and minutes.
#
# Needs the nightly toolchain and a C++ compiler, not cargo-fuzz: the flags are those that `cargo fuzz build` passes.
set -eu
cd "$(dirname "$0")/../.."
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
export CARGO_TARGET_DIR

seconds=${1:-5}
seed=${2:-1}

# Where execution goes, for libFuzzer; every comparison, so that it can find magic numbers; no branches folded away.
sancov="-Cpasses=sancov-module"
for option in level=4 inline-8bit-counters pc-table trace-compares stack-depth; do
    sancov="$sancov -Cllvm-args=-sanitizer-coverage-$option"
done
# No `--cfg fuzzing`: other people's crates as they are in the image. Some of them print a lot where it is set.
flags="$sancov -Cllvm-args=-simplifycfg-branch-fold-threshold=0 -Zsanitizer=address -Cdebug-assertions -Ccodegen-units=1"
host=$(rustc +nightly -vV | sed -n 's/^host: //p')
RUSTFLAGS=$flags cargo +nightly build --quiet --release --manifest-path fuzz/Cargo.toml --target "$host" \
    --config 'profile.release.debug="line-tables-only"'

# The crates have no heap; what the harness makes for the length of a run (the port of a console) is never given back.
export ASAN_OPTIONS=detect_odr_violation=0:detect_leaks=0
fuzz() {
    log=$CARGO_TARGET_DIR/fuzz-$1.log
    # New finds stay out of the checked-in corpus; what makes it fail goes beside the log.
    finds=$(mktemp -d)
    if ! "$CARGO_TARGET_DIR/$host/release/$1" "$finds" "fuzz/corpus/$1" -artifact_prefix="$CARGO_TARGET_DIR/fuzz-$1-" \
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
for target in $(sed -n 's/^path = "fuzz_targets\/\(.*\)\.rs"$/\1/p' fuzz/Cargo.toml); do
    fuzz "$target" &
    if [ -n "$other" ]; then
        wait "$other"
    fi
    other=$!
done
wait "$other"
