#!/bin/sh
# The crate builds for targets without an operating system, in every combination of its features.
#
# Not optimised: twelve times the same code, and the image and the sizes show that it can be.
set -eu
. "$(dirname "$0")/common.sh"

cd "$root"
for target in thumbv6m-none-eabi thumbv7em-none-eabihf riscv32imc-unknown-none-elf; do
    rustup target add "$target" >/dev/null 2>&1 || true
    for features in "" defmt serde defmt,serde; do
        RUSTFLAGS="-D warnings" cargo --config profile.dev.package.clino-codec.opt-level=0 build --quiet --package clino-codec --target "$target" --features "$features"
    done
    echo "targets: builds for $target"
done
