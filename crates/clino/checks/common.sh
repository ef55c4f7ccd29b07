# Sourced by the checks that measure: builds the tool as a release, and measures it.
#
# Only the tool is a release: the tests that measure it are those that are built already. It is without `serve` and `bridge`,
# which are not measured and are most of what there is to build.

. "$(dirname "$0")/../../codec/checks/common.sh"
cd "$root"

# Runs tests on the tool; what is given here goes to `cargo test`.
measure() {
    cargo build --quiet --release --package clino --no-default-features
    # shellcheck disable=SC2086
    CLINO_TOOL=$CARGO_TARGET_DIR/release/clino cargo test --quiet ${CLINO_FEATURES:+--features $CLINO_FEATURES} "$@"
}
