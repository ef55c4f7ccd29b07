#!/bin/sh
# The crate can be published: it packages, and the package builds on its own.
set -eu
. "$(dirname "$0")/common.sh"

cd "$root"
cargo package --quiet --allow-dirty --package clino-codec
echo "package: $(ls -t "$CARGO_TARGET_DIR"/package/clino-codec-*.crate | head -n 1 | xargs basename) builds"
