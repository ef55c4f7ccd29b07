#!/bin/sh
# The crates that others use can be published: they package together, and from the packages, outside the workspace, the
# example programs build: all, or those named. The Linux one reads an angle from `clino sim --pty`.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

[ $# -gt 0 ] || set -- $(ls "$root/examples")
cd "$root"

selection=
for crate in $published; do selection="$selection --package $crate"; done
# That they build on their own is shown below.
cargo package --quiet --allow-dirty --no-verify $selection
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)

outside=$(mktemp -d)
sensor=
trap 'test -z "$sensor" || kill "$sensor"; rm -rf "$outside"' EXIT
patches=
for crate in $published; do
    package=$CARGO_TARGET_DIR/package/$crate-$version.crate
    tar -C "$outside" -xzf "$package"
    for file in README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE; do
        test -f "$outside/$crate-$version/$file" || { echo "package: $crate has no $file" >&2; exit 1; }
    done
    patches="$patches --config patch.crates-io.$crate.path=\"$outside/$crate-$version\""
    echo "package: $crate-$version, $(wc -c <"$package") B"
done

for example in "$@"; do
    begun=$(date +%s)
    cp -r "$root/examples/$example" "$outside/$example"
    cd "$outside/$example"
    rm -rf target
    # As a user writes it: a version and no path.
    sed -i 's/, path = "[^"]*"//' Cargo.toml
    target=$(sed -n 's/^target = "\(.*\)"$/\1/p' .cargo/config.toml 2>/dev/null || true)
    [ -z "$target" ] || rustup target add "$target" >/dev/null 2>&1 || true
    # The patches that an example does not need are warned about, at length.
    CARGO_TARGET_DIR=$CARGO_TARGET_DIR/examples cargo build --quiet --release $patches 2>"$outside/log" || {
        cat "$outside/log" >&2
        exit 1
    }
    echo "package: $example builds from the packages, outside the workspace, $(($(date +%s) - begun)) s"
done

case " $* " in
*" linux-serial "*)
    cd "$root"
    # `cargo xtask check` has built it.
    tool=${CLINO_TOOL:-}
    if [ -z "$tool" ]; then
        cargo build --quiet --package clino
        tool=$CARGO_TARGET_DIR/debug/clino
    fi
    # A fifo is read as soon as there is a line.
    mkfifo "$outside/path"
    "$tool" sim --t7 5,angle=12.345 --pty >"$outside/path" 2>/dev/null &
    sensor=$!
    read -r path <"$outside/path"
    angle=$("$CARGO_TARGET_DIR/examples/release/linux-serial" "$path" 5)
    kill "$sensor" && sensor=
    if [ "$angle" != "12.345°" ]; then
        echo "package: linux-serial read $angle from clino sim, not 12.345°" >&2
        exit 1
    fi
    echo "package: linux-serial read $angle from clino sim"
    ;;
esac
