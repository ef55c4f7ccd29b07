# Sourced by the checks: builds the release image and inspects it.

cd "$(dirname "$0")/../../.."
target=thumbv7em-none-eabihf

# Features of the image: none is the shipped one.
features=

# What to inspect, and the tables that it needs.
inspect() {
    # shellcheck disable=SC2086
    cargo build --quiet --release --package clino-firmware --target "$target" ${features:+--no-default-features --features $features}
    elf=${CARGO_TARGET_DIR:-target}/$target/release/clino-firmware
    cargo run --quiet --package clino-inspect -- "$@" "$elf"
}
