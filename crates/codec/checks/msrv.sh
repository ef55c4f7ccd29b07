#!/bin/sh
# The crate's tests pass with the oldest compiler it promises to support.
set -eu
. "$(dirname "$0")/common.sh"

cd "$root"
version=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
if ! rustup toolchain install "$version" --profile minimal >/dev/null 2>&1; then
    echo "msrv: SKIPPED, NOTHING WAS TESTED: Rust $version cannot be installed on this machine" >&2
    exit 0
fi
# What it depends on is not worth optimising for one run.
cargo "+$version" --config 'profile.dev.package."*".opt-level=0' test --quiet --package clino-codec --features defmt,serde --lib --test vectors
echo "msrv: tests pass with Rust $version"
