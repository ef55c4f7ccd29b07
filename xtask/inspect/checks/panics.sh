#!/bin/sh
# The panics left in the release image are those of docs/panics.md, each with its reason.
set -eu
. "$(dirname "$0")/common.sh"
inspect panics docs/panics.md
