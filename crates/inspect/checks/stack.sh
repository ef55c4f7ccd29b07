#!/bin/sh
# The worst-case stack of the release image, computed from the image. What cannot be seen there is in ../stack.toml.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
cd "$root"
target=thumbv7em-none-eabihf
cargo build --quiet --release --package clino-firmware --target "$target"
elf=${CARGO_TARGET_DIR:-$root/target}/$target/release/clino-firmware
cargo run --quiet --package clino-inspect -- stack crates/inspect/stack.toml "$elf"
