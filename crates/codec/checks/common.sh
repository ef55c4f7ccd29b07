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

# Makes sure that a program is there, from Debian's package of that name where apt-get can install it.
needs() {
    command -v "$1" >/dev/null 2>&1 && return
    if command -v apt-get >/dev/null 2>&1 && [ "$(id -u)" = 0 ]; then
        { apt-get update && apt-get install --yes --no-install-recommends "$1"; } >/dev/null 2>&1 || true
    fi
    command -v "$1" >/dev/null 2>&1 || {
        echo "$(basename "$0"): needs $1; install it first" >&2
        exit 1
    }
}
