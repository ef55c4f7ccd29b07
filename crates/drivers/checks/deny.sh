#!/bin/sh
# What the crates that others use depend on has the licences and comes from the places that `deny.toml` allows, and nothing in
# it needs an operating system. What is planted against each of the three is noticed. `deny.sh --install` installs cargo-deny.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

if ! has_subcommand deny "${1:-}"; then
    skipped "deny: what the crates depend on was not checked: cargo-deny is not installed; \`cargo xtask campaign published\` installs it"
    exit 0
fi
cd "$root"
outside=$(mktemp -d)
trap 'rm -rf "$outside"' EXIT

# Folder of the crate, configuration, what is checked.
deny() {
    cargo deny --log-level error --config "$2" --manifest-path "$1/Cargo.toml" --all-features --exclude-dev \
        check "$3" >"$outside/log" 2>&1
}

# What is checked, the error's name, and a configuration that the dependencies of the drivers do not fit.
planted() {
    printf '%b' "$3" >"$outside/planted.toml"
    if deny crates/drivers "$outside/planted.toml" "$1" || ! grep -q "error\\[$2\\]" "$outside/log"; then
        cat "$outside/log" >&2
        echo "deny: what is not allowed was not noticed: $1" >&2
        exit 1
    fi
}
planted licenses rejected '[licenses]\nallow = ["ISC"]\n'
planted bans banned '[bans]\ndeny = ["embedded-hal"]\n'
planted sources source-not-allowed '[sources]\nunknown-registry = "deny"\nallow-registry = []\n'

for folder in $published_folders; do
    for what in licenses bans sources; do
        deny "$folder" "$root/deny.toml" "$what" || {
            cat "$outside/log" >&2
            exit 1
        }
    done
done
echo "deny: licences, bans and sources of $(echo $published | wc -w) crates are as deny.toml has them (what is planted against each is noticed)"
skipped "deny: advisories: their database cannot be reached from every machine"
