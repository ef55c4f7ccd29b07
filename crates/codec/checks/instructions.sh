#!/bin/sh
# Instructions on x86-64 of decoding one Get Angle answer, and of finding it in a stream and decoding it.
set -eu
. "$(dirname "$0")/common.sh"

needs valgrind

decode_limit=80
frame_limit=250
few=1000
many=11000

cd "$crate/bench"
RUSTFLAGS="" cargo build --quiet --release --target x86_64-unknown-linux-gnu
bench=$CARGO_TARGET_DIR/x86_64-unknown-linux-gnu/release/clino-codec-bench

instructions() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$bench" "$1" "$2" 2>&1 |
        awk '/Collected/ { print $NF }'
}

# Cost of one operation, rounded up, loop included.
cost() {
    echo $((($(instructions "$1" $many) - $(instructions "$1" $few) + many - few - 1) / (many - few)))
}

decode=$(cost decode)
frame=$(cost frame)
echo "instructions: decode of a Get Angle answer $decode (limit $decode_limit)"
echo "instructions: framing and decode of 8 bytes $frame (limit $frame_limit)"
[ "$decode" -gt 0 ] && [ "$decode" -le $decode_limit ] && [ "$frame" -le $frame_limit ]
