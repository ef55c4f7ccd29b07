#!/bin/sh
# The reusable crates build for a Cortex-M0 and a Cortex-M4F, with all features that do not need the host.
set -eu
for target in thumbv6m-none-eabi thumbv7em-none-eabihf; do
    rustup target add "$target" >/dev/null 2>&1
    for package in clino-bus clino-commissioning clino-drivers; do
        cargo check --quiet --package "$package" --all-features --target "$target"
        echo "targets: $package builds for $target"
    done
done
