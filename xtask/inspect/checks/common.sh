# Sourced by the checks: builds the release image and inspects it.

cd "$(dirname "$0")/../../.."
target=thumbv7em-none-eabihf

# What to inspect, and the tables that it needs.
inspect() {
    cargo build --quiet --release --package clino-firmware --target "$target"
    elf=${CARGO_TARGET_DIR:-target}/$target/release/clino-firmware
    cargo run --quiet --package clino-inspect -- "$@" "$elf"
}
