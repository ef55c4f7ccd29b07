# Sourced by the checks: where things are, and one target directory for all of them.

here=$(cd "$(dirname "$0")" && pwd)
crate=$(dirname "$here")
root=$(cd "$crate/../.." && pwd)
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target}
export CARGO_TARGET_DIR

# The crates that others use, each after what it depends on, and where they are.
published="clino-codec clino-bus clino-commissioning clino-drivers clino-sim clino-segment"
published_folders="crates/codec crates/bus crates/commissioning crates/drivers sim/sensors sim/segment"

# Says loudly that something was not checked: here, and at the end of `cargo xtask check`.
skipped() {
    echo "SKIPPED: $1" >&2
    [ -z "${CLINO_SKIPPED:-}" ] || echo "SKIPPED: $1" >>"$CLINO_SKIPPED"
}

# Whether cargo has this subcommand. With $2 = --install it is installed first if it is missing.
has_subcommand() {
    cargo "$1" --version >/dev/null 2>&1 && return
    [ "${2:-}" = --install ] || return
    begun=$(date +%s)
    # Its own target directory: it has nothing in common with ours. Little optimisation: it is built longer than it runs.
    CARGO_TARGET_DIR="$CARGO_TARGET_DIR/installing" CARGO_PROFILE_RELEASE_OPT_LEVEL=1 CARGO_PROFILE_RELEASE_LTO=off \
        CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 cargo install --quiet --locked "cargo-$1" || exit
    rm -rf "$CARGO_TARGET_DIR/installing"
    echo "cargo-$1: installed, $(($(date +%s) - begun)) s"
}

# The workspace's linker arguments are for the firmware; the probe programs here have none.
bare_metal_build() {
    rustup target add "$1" >/dev/null 2>&1 || true
    target=$1
    shift
    RUSTFLAGS="-C link-arg=--nmagic" cargo build --quiet --release --target "$target" "$@"
}

# Flash that a program takes. One that takes none was not linked as it should be.
flash_of() {
    rustup component add llvm-tools >/dev/null 2>&1 || true
    tool=$(find "$(rustc --print sysroot)" -name llvm-size -type f | head -n 1)
    bytes=$("$tool" "$1" | awk 'NR == 2 { print $1 + $2 }')
    if [ "${bytes:-0}" -lt 100 ]; then
        echo "$1 has ${bytes:-no} bytes of code: it was not linked" >&2
        exit 1
    fi
    echo "$bytes"
}

# Builds the probe program of a crate, which links only if no panic is reachable; first with a panic planted in it, to show
# that the check can fail. What is checked is $1.
no_panic_is_reachable() {
    planted=$CARGO_TARGET_DIR/nopanic-planted.log
    cd "$crate/nopanic"
    if bare_metal_build thumbv7em-none-eabihf --features planted 2>"$planted"; then
        echo "nopanic: a planted panic was not noticed" >&2
        exit 1
    fi
    if ! grep -q "undefined symbol: a_panic_is_reachable" "$planted"; then
        cat "$planted" >&2
        echo "nopanic: the planted panic failed to build for another reason" >&2
        exit 1
    fi
    if ! bare_metal_build thumbv7em-none-eabihf; then
        echo "nopanic: a panic is reachable in $1" >&2
        exit 1
    fi
    echo "nopanic: 0 reachable panics in $1 on thumbv7em-none-eabihf (a planted one is noticed)"
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
