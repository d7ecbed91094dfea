#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the tests marked `blender` in a real Blender >= 5.0: the one named by BLENDER, or one
# installed below .blender/. Skips only where none can be installed.
set -euo pipefail
cd "$(dirname "$0")/.."
if [ -z "${BLENDER:-}" ]; then
  if ! bash .ci/install_blender.sh .blender; then
    echo "test-blender skipped: no Blender 5.0 or newer can be installed here (see above)."
    echo "0 passed, 0 failed, 1 skipped"
    exit 0
  fi
  export BLENDER="$PWD/.blender/blender"
fi
# The tests of the interface draw on a screen that nobody sees.
if ! command -v Xvfb >/dev/null && [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
  echo "Installing xvfb"
  bash .ci/apt_install.sh xvfb ||
    echo "xvfb cannot be installed; tests that need a window are skipped"
fi
.venv/bin/pytest -m blender tests
