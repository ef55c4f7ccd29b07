#!/bin/sh
# The crate's tests pass with the oldest compiler it promises to support.
set -eu
. "$(dirname "$0")/common.sh"

cd "$root"
version=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
rustup toolchain install "$version" --profile minimal >/dev/null 2>&1
cargo "+$version" test --quiet --package clino-codec --features defmt,serde --lib --test vectors
echo "msrv: tests pass with Rust $version"
