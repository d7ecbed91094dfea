#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the tests of the add-on inside other versions of pip's bpy than the one in .venv/:
# .ci/test_bpy.sh [VERSION…]. Without one: the oldest that is supported and the newest for
# Python 3.11. Each has an environment of its own below .blender/, with all else from .venv/.
set -euo pipefail
cd "$(dirname "$0")/.."
versions=("$@")
[ ${#versions[@]} -gt 0 ] || versions=(4.2.0 5.0.1)
all_else=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
failed=()
for version in "${versions[@]}"; do
  environment=.blender/bpy-$version
  if ! "$environment/bin/python" -c "import bpy" 2>/dev/null; then
    .venv/bin/python -m venv "$environment"
    "$environment/bin/python" -m pip install --quiet --no-deps "bpy==$version"
    own=$("$environment/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
    # Behind the environment's own packages, so that its bpy is the one that is found.
    echo "$all_else" >"$own/all_else.pth"
  fi
  found=$("$environment/bin/python" -c 'import bpy; print(bpy.app.version_string)')
  echo "bpy $version: Blender $found"
  "$environment/bin/python" -m pytest tests/addon_rfgs/test_{inside_blender,leaves_nothing}.py ||
    failed+=("$version")
done
[ ${#failed[@]} -eq 0 ] || { echo "failed in bpy ${failed[*]}" >&2; exit 1; }
