#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Has numba and Dr.Jit compile their kernels once, in two rows of processes beside each other: one
# makes, fits and measures a few frames that are thrown away; the other traces a random world, poses
# a body and checks pictures. Runs and their workers then load kernels from caches.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export folder bin=${1:-.venv/bin}
exec 3>&2 >"$folder/log" 2>&1
trap 'cat "$folder/log" >&3' ERR

frames() {
  "$bin"/python -m dataset_factory generate living_room_walk --radio wifi --frames 10 --workers 1 \
    --no-images --out "$folder/data"
  local example
  example=$("$bin"/python -c 'from rfgs_core.example import example_folder; print(example_folder())')
  "$bin"/python -m rfgs_core.cli train "$example/dataset" --radio small_wifi --frames 10:26:8 \
    --gaussians 1000 --out "$folder/run"
  "$bin"/python -m rfgs_core.cli eval "$folder/run"
}

worlds() {
  "$bin"/python -m dataset_factory worlds --radio wifi_commodity --count 1 --people 1 --frames 2 \
    --depth 2 --out "$folder/worlds"
  "$bin"/python -c 'import numpy as np
from rfgs_core.articulated import fit_pose, people
from rfgs_core.limbs.evidence.library import upright
body = people().body(np.zeros(0))
fit_pose(body, body.joints17(upright(body)), np.ones(17), None)'
  "$bin"/python -m rfgs_core.cli selftest
}

# By xargs rather than `&`, so that Ctrl-C ends both.
export -f frames worlds
printf '%s\n' frames worlds | xargs -P 2 -n 1 bash -euo pipefail -c '"$1"' row
