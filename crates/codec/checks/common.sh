# Sourced by the checks: where things are, and one target directory for all of them.

here=$(cd "$(dirname "$0")" && pwd)
crate=$(dirname "$here")
root=$(cd "$crate/../.." && pwd)
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target}
export CARGO_TARGET_DIR

# The workspace's linker arguments are for the firmware; the probe programs here have none.
bare_metal_build() {
    rustup target add "$1" >/dev/null 2>&1 || true
    target=$1
    shift
    RUSTFLAGS="-C link-arg=--nmagic" cargo build --quiet --release --target "$target" "$@"
}
