#!/bin/sh
# The crates that others use build with the oldest compiler that they promise, and the codec's tests pass with it.
set -eu
. "$(dirname "$0")/common.sh"

cd "$root"
promised=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' crates/codec/Cargo.toml crates/bus/Cargo.toml \
    crates/commissioning/Cargo.toml crates/drivers/Cargo.toml sim/sensors/Cargo.toml sim/segment/Cargo.toml | sort -u)
case $promised in
*[!0-9.]* | "")
    echo "msrv: the crates promise different compilers:" $promised >&2
    exit 1
    ;;
esac
if ! rustup toolchain install "$promised" --profile minimal >/dev/null 2>&1; then
    echo "msrv: SKIPPED, NOTHING WAS TESTED: Rust $promised cannot be installed on this machine" >&2
    exit 0
fi
# What it depends on is not worth optimising for one run.
cargo "+$promised" --config 'profile.dev.package."*".opt-level=0' test --quiet --package clino-codec --features defmt,serde --lib --test vectors
cargo "+$promised" check --quiet --package clino-bus --package clino-commissioning --package clino-drivers --package clino-sim \
    --package clino-segment --all-features
echo "msrv: the codec's tests pass, and all crates that others use build, with Rust $promised"
