#!/bin/sh
# The crates that others use build with the oldest compiler that they promise, and the codec's tests pass with it.
set -eu
. "$(dirname "$0")/common.sh"

cd "$root"
manifests=
for folder in $published_folders; do manifests="$manifests $folder/Cargo.toml"; done
promised=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' $manifests | sort -u)
case $promised in
*[!0-9.]* | "")
    echo "msrv: the crates promise different compilers:" $promised >&2
    exit 1
    ;;
esac
if ! rustup toolchain install "$promised" --profile minimal >/dev/null 2>&1; then
    skipped "msrv: NOTHING WAS TESTED: Rust $promised cannot be installed on this machine"
    exit 0
fi
cargo "+$promised" test --quiet --package clino-codec --features defmt,serde --lib --test vectors
selection=
for package in $published; do selection="$selection --package $package"; done
cargo "+$promised" check --quiet $selection --all-features
echo "msrv: the codec's tests pass, and all crates that others use build, with Rust $promised"
