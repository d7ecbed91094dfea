#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the wheel and tries it in a bare environment: no extras, so neither Blender nor Sionna RT,
# and NumPy 2. `PYTHON=python3.13 .ci/test_wheel.sh` takes another Python. With VENV=FOLDER the
# environment is made there and kept, else it is made in a temporary folder and removed.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3.11}
command -v "$python" >/dev/null || python=python3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
venv=${VENV:-$work/venv}
[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"

"$venv/bin/python" -m pip wheel --quiet --no-deps --wheel-dir "$work" .
wheel=$(echo "$work"/rfgs-*.whl)
echo "$("$python" --version): $(basename "$wheel"), $(du -k "$wheel" | cut -f1) kB"
# The pins, but for NumPy: the oldest that bpy needs is pinned, and this is about a newer one.
grep -v '^numpy==' constraints.txt >"$work/constraints.txt"
echo 'numpy>=2' >>"$work/constraints.txt"
"$venv/bin/python" -m pip install --quiet --constraint "$work/constraints.txt" "$wheel"
# Once more, as a kept environment may hold an older build of the same version.
"$venv/bin/python" -m pip install --quiet --force-reinstall --no-deps "$wheel"
"$venv/bin/python" -m pip check

# From another folder, so that the wheel is what is imported, and not this clone.
cp tests/tiny_dataset.py tests/packaging/try_wheel.py "$work"
cd "$work"
export PATH="$venv/bin:$PATH" PYTHONDONTWRITEBYTECODE=1
rfgs --help >/dev/null
rfgs-factory --help >/dev/null
rfgs info
python try_wheel.py
