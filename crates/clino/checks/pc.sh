#!/bin/sh
# How fast `clino` is on a bus, in a release build, and its limits. The computer should have nothing else to do.
set -eu
. "$(dirname "$0")/common.sh"
measure --test bus -- --ignored --exact numbers::figures --nocapture
