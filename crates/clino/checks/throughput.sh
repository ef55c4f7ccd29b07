#!/bin/sh
# Frames per second of `clino … decode --stdin` in a release build; fails below 100 000.
set -eu
. "$(dirname "$0")/common.sh"
measure --test throughput -- --ignored --nocapture
