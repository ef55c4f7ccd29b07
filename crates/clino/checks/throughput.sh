#!/bin/sh
# Frames per second of `clino … decode --stdin` in a release build; fails below 100 000.
set -eu
cd "$(dirname "$0")/.."
cargo test --quiet --release --test throughput -- --ignored --nocapture
