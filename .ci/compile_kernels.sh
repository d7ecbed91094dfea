#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Has numba and Dr.Jit compile their kernels once, in one process after the other, by making, fitting
# and measuring a few frames that are thrown away. Runs and their workers then load them from caches.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
bin=${1:-.venv/bin}
exec 3>&2 >"$folder/log" 2>&1
trap 'cat "$folder/log" >&3' ERR
"$bin"/python -m dataset_factory generate living_room_walk --radio wifi --frames 10 --workers 1 \
  --no-images --out "$folder/data"
example=$("$bin"/python -c 'from rfgs_core.example import example_folder; print(example_folder())')
"$bin"/python -m rfgs_core.cli train "$example/dataset" --radio small_wifi --frames 10:26:8 \
  --gaussians 1000 --out "$folder/run"
"$bin"/python -m rfgs_core.cli eval "$folder/run"
