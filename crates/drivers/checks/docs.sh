#!/bin/sh
# The documentation of the crates that others use builds as docs.rs builds it, and what needs a feature has a badge that says which.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

cd "$root"
if ! rustc +nightly --version >/dev/null 2>&1; then
    skipped "docs: the badges were not looked at: docs.rs uses a nightly compiler, and there is none on this machine"
    exit 0
fi
selection=
for package in $published; do selection="$selection --package $package"; done
# As `[package.metadata.docs.rs]` of each crate has it.
RUSTDOCFLAGS="--cfg docsrs -D warnings" cargo +nightly doc --quiet --no-deps --all-features --target-dir "$CARGO_TARGET_DIR/docsrs" $selection

badges=0
# What needs a feature, and the feature.
while read -r page feature; do
    if ! grep -q "Available on <strong>crate feature <code>$feature</code></strong>" "$CARGO_TARGET_DIR/docsrs/doc/$page"; then
        echo "docs: $page has no badge of the feature $feature" >&2
        exit 1
    fi
    badges=$((badges + 1))
done <<'PAGES'
clino_drivers/asynch/index.html async
clino_drivers/run/index.html commissioning
clino_drivers/trait.AsyncPort.html async
clino_drivers/uart/struct.Nb.html nb
clino_drivers/uart/struct.Io.html embedded-io
clino_drivers/uart/struct.Io06.html embedded-io-06
PAGES
echo "docs: as docs.rs builds it, $badges badges of features"
