#!/bin/sh
# The worst-case stack of the release image, computed from the image. What cannot be seen there is in ../stack.toml.
set -eu
. "$(dirname "$0")/common.sh"
inspect stack xtask/inspect/stack.toml budgets.toml
