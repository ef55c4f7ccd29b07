#!/bin/sh
# How fast `clino` is on a bus, in a release build, and its limits. The computer should have nothing else to do.
set -eu
cd "$(dirname "$0")/.."
cargo test --quiet --release --test bus -- --ignored --exact numbers::figures --nocapture
