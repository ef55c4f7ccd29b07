#!/bin/sh
# No panic is reachable from any public entry point of bus and gateway: the probe program links only if that is so.
# Shows first that the check can fail, by planting a panic.
set -eu
. "$(dirname "$0")/../../codec/checks/common.sh"

no_panic_is_reachable "bus and gateway"
