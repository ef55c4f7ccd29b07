#!/bin/sh
# The public interface of the crates that others use, compared with that of the last version that is out (tag crates-v…), or
# of a revision that is named: what breaks a user fails. Until a version is out it is compared with that of thirty commits
# ago, and reported only. A change that breaks a user is noticed. `semver.sh --install` installs cargo-semver-checks.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

install=
if [ "${1:-}" = --install ]; then install=$1 && shift; fi
if ! has_subcommand semver-checks "$install"; then
    skipped "semver: the public interface was not compared: cargo-semver-checks is not installed; \`cargo xtask campaign published\` installs it"
    exit 0
fi
cd "$root"
outside=$(mktemp -d)
trap 'rm -rf "$outside"' EXIT

# A method of the codec gets another name.
cargo package --quiet --allow-dirty --no-verify --package clino-codec
for copy in before after; do
    mkdir "$outside/$copy"
    tar -C "$outside/$copy" --strip-components=1 -xzf "$CARGO_TARGET_DIR"/package/clino-codec-[0-9]*.crate
done
sed -i 's/pub const fn is_all(/pub const fn is_everyone(/' "$outside/after/src/t7/address.rs"
sed -i 's/\.is_all()/.is_everyone()/' "$outside"/after/src/t7/*.rs
compare() { cargo semver-checks --color never "$@"; }
if compare --manifest-path "$outside/after/Cargo.toml" --baseline-root "$outside/before" >"$outside/log" 2>&1; then
    echo "semver: a planted change that breaks a user was not noticed" >&2
    exit 1
fi
if ! grep -q 'inherent_method_missing' "$outside/log"; then
    cat "$outside/log" >&2
    echo "semver: the planted change failed for another reason" >&2
    exit 1
fi
echo "semver: a planted change that breaks a user is noticed"

selection=
for package in $published; do selection="$selection --package $package"; done
baseline=${1:-$(git describe --tags --abbrev=0 --match 'crates-v*' 2>/dev/null || true)}
if [ -n "$baseline" ]; then
    compare --baseline-rev "$baseline" $selection
    echo "semver: nothing breaks a user of $baseline"
    exit 0
fi
baseline=$(git rev-parse --short HEAD~30)
compare --baseline-rev "$baseline" $selection >"$outside/log" 2>&1 || true
if ! grep -q 'Summary' "$outside/log"; then
    cat "$outside/log" >&2
    echo "semver: the public interface could not be compared" >&2
    exit 1
fi
grep -E '^ *(--- failure|Summary|Checking clino)' "$outside/log" || true
skipped "semver: no version is out (no tag crates-v…): what differs from $baseline was reported, and is no failure"
