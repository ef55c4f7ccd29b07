#!/bin/sh
# Instructions on x86-64 of reading one angle, from the call to the value, over a port that answers at once.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

needs valgrind

# What was accepted last, and a tenth.
t7_limit=2560
isu_limit=2960
few=1000
many=11000

cd "$crate/bench"
RUSTFLAGS="" cargo build --quiet --release --locked --target x86_64-unknown-linux-gnu
bench=$CARGO_TARGET_DIR/x86_64-unknown-linux-gnu/release/clino-drivers-bench

instructions() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$bench" "$1" "$2" 2>&1 |
        awk '/Collected/ { print $NF }'
}

failed=
for sensor in t7 isu; do
    # It asserts what it reads.
    "$bench" $sensor 1
    cost=$((($(instructions $sensor $many) - $(instructions $sensor $few) + many - few - 1) / (many - few)))
    eval "limit=\$${sensor}_limit"
    echo "driver-instructions: one angle of a $sensor $cost (limit $limit)"
    [ "$cost" -le "$limit" ] || failed=1
done
[ -z "$failed" ]
