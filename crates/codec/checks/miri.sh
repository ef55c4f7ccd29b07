#!/bin/sh
# The tests under Miri in both byte orders. Whole domains are left to the other runs: Miri interprets.
set -eu
. "$(dirname "$0")/common.sh"

rustup component add miri rust-src --toolchain nightly >/dev/null 2>&1
cd "$root"
export PROPTEST_CASES=4
export PROPTEST_FAILURE_PERSISTENCE=off
export MIRIFLAGS="-Zmiri-disable-isolation -Zmiri-strict-provenance"

for target in x86_64-unknown-linux-gnu s390x-unknown-linux-gnu; do
    cargo +nightly miri setup --quiet --target "$target"
    cargo +nightly miri test --quiet --package clino-codec --target "$target" --lib \
        --test angle --test ascii --test isu_eeprom --test isu_messages --test isu_stream --test checks \
        --test properties --test pwm --test t7_messages --test t7_stream --test vectors \
        -- --skip every_angle_has_its_line --skip all_65536 --skip the_idealised_law_is_the_counter \
        --skip exact_halves --skip codes_without_a_meaning --skip every_answer_has_the_bytes_of_its_table_and_comes_back
    echo "miri: no finding on $target"
done
