#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs Debian packages, waiting up to five minutes for another such call or another apt.
set -euo pipefail
exec 9>/var/lock/rfgs-apt
flock -w 300 9 || { echo "error: another installation is still at work; try again" >&2; exit 2; }
apt-get update -qq
DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 install -y -qq \
  --no-install-recommends "$@" >/dev/null
