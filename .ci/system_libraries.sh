#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes sure the shared libraries that Sionna RT (LLVM) and Blender's Python module load are there.
set -euo pipefail

missing=()
have() { ldconfig -p | grep -q "$1"; }
need() { have "$1" || missing+=("$2"); }
need 'libLLVM\(-1[6-9]\|-2[0-9]\|\.so\.1[6-9]\|\.so\.2[0-9]\)' libllvm19
need 'libX11\.so\.6' libx11-6
need 'libXrender\.so\.1' libxrender1
need 'libXi\.so\.6' libxi6
need 'libXxf86vm\.so\.1' libxxf86vm1
need 'libXfixes\.so\.3' libxfixes3
need 'libxkbcommon\.so\.0' libxkbcommon0
need 'libSM\.so\.6' libsm6
need 'libICE\.so\.6' libice6
need 'libGL\.so\.1' libgl1
need 'libEGL\.so\.1' libegl1
need 'libgomp\.so\.1' libgomp1
[ ${#missing[@]} -eq 0 ] && exit 0

if ! command -v apt-get >/dev/null; then
  echo "error: missing system libraries; install your system's packages for: ${missing[*]}" >&2
  exit 2
fi
if [ "$(id -u)" -ne 0 ]; then
  echo "error: missing system libraries; run: sudo apt-get update &&" \
    "sudo apt-get install -y --no-install-recommends ${missing[*]}" >&2
  exit 2
fi
echo "Installing system libraries: ${missing[*]}"
exec bash "$(dirname "$0")/apt_install.sh" "${missing[@]}"
