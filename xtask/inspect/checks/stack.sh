#!/bin/sh
# The worst-case stack of the release images for all boards, computed from the images. What cannot be seen there is in ../stack.toml.
set -eu
. "$(dirname "$0")/common.sh"
# The shipped one last: it stays where everybody looks for it.
for features in full,defmt,board-nucleo-f446re full,defmt,board-f407ve ''; do
    echo "$features"
    inspect stack xtask/inspect/stack.toml budgets.toml
done
