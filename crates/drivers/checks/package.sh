#!/bin/sh
# The crates that others use can be published: they package together, what they depend on is allowed, and from the
# packages, outside the workspace, the example programs build: all, or those named. The Linux one reads an angle from
# `clino sim --pty`.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

[ $# -gt 0 ] || set -- f411-nb rp2040-embassy esp32c3 linux-serial
crates="clino-codec clino-bus clino-commissioning clino-drivers clino-sim clino-segment"
cd "$root"

selection=
for crate in $crates; do selection="$selection --package $crate"; done
# That they build on their own is shown below.
cargo package --quiet --allow-dirty --no-verify $selection
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)

outside=$(mktemp -d)
sensor=
trap 'test -z "$sensor" || kill "$sensor"; rm -rf "$outside"' EXIT
patches=
for crate in $crates; do
    package=$CARGO_TARGET_DIR/package/$crate-$version.crate
    tar -C "$outside" -xzf "$package"
    for file in README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE; do
        test -f "$outside/$crate-$version/$file" || { echo "package: $crate has no $file" >&2; exit 1; }
    done
    patches="$patches --config patch.crates-io.$crate.path=\"$outside/$crate-$version\""
    echo "package: $crate-$version, $(wc -c <"$package") B"
done

for example in "$@"; do
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
    echo "package: $example builds from the packages, outside the workspace"
done

case " $* " in
*" linux-serial "*)
    cd "$root"
    cargo build --quiet --package clino
    # A fifo is read as soon as there is a line.
    mkfifo "$outside/path"
    "$CARGO_TARGET_DIR/debug/clino" sim --t7 5,angle=12.345 --pty >"$outside/path" 2>/dev/null &
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

cd "$root"
if command -v cargo-deny >/dev/null 2>&1; then
    for folder in crates/codec crates/bus crates/commissioning crates/drivers sim/sensors sim/segment; do
        cargo deny --log-level error --manifest-path "$folder/Cargo.toml" --all-features --exclude-dev check licenses bans sources
    done
    echo "package: licenses, bans and sources are as deny.toml has them; advisories are SKIPPED: their database is not on this machine"
else
    echo "package: SKIPPED: what the crates depend on was not checked, cargo-deny is not installed (cargo install --locked cargo-deny)" >&2
fi

# Until a version is out, a change of the public interface is reported only.
released=$(git describe --tags --abbrev=0 --match 'crates-v*' 2>/dev/null || true)
if ! cargo semver-checks --version >/dev/null 2>&1; then
    echo "package: SKIPPED: the public interface was not compared, cargo-semver-checks is not installed (cargo install --locked cargo-semver-checks)" >&2
elif [ -z "$released" ]; then
    echo "package: SKIPPED: no version is out yet (no tag crates-v…) with which the public interface could be compared" >&2
else
    cargo semver-checks --quiet --baseline-rev "$released" $selection
    echo "package: the public interface fits the versions since $released"
fi
