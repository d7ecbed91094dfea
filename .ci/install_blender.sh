#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs a real Blender >= 5.0 into DIR (default .blender) from Debian unstable, beside the
# running system and without touching it, and leaves the wrapper DIR/blender.
# Falls back to Debian 13's 4.3 where unstable cannot be installed, and says which it took;
# the second argument, sid or trixie, allows that one only.
set -eu

usage() { echo "usage: $0 [DIR [sid|trixie]]    installs Blender into DIR (default: .blender of this clone)"; }
fail() { echo "error: $*" >&2; exit 2; }

case "${1:-}" in
  -h | --help) usage; exit 0 ;;
  -*) usage >&2; exit 2 ;;
esac
clone=$(cd "$(dirname "$0")/.." && pwd)
dir=${1:-$clone/.blender}
wanted=${2:-}
case "$wanted" in
  "" | sid | trixie) ;;
  *) usage >&2; exit 2 ;;
esac

version_of() { "$1" --version 2>/dev/null | sed -n 's/^Blender \([0-9][0-9.]*\).*/\1/p' | head -n 1; }

if [ -x "$dir/blender" ]; then
  version=$(version_of "$dir/blender")
  if [ -n "$version" ]; then
    echo "Blender $version is already in $dir"
    exit 0
  fi
fi

[ "$(id -u)" = 0 ] || fail "installing Blender needs root; run: sudo $0 $dir
(or set BLENDER=/path/to/a/blender of version 5.0 or newer)"
command -v apt-get >/dev/null || fail "this script needs Debian's apt; set BLENDER=/path/to/blender instead"
if ! command -v debootstrap >/dev/null; then
  echo "installing debootstrap"
  bash "$(dirname "$0")/apt_install.sh" debootstrap || fail "debootstrap is missing; run: apt-get install debootstrap"
fi

# The mirror this machine already uses: the first Debian main archive in apt's configuration.
mirror=$(apt-get indextargets --format '$(ORIGIN) $(COMPONENT) $(REPO_URI)' 'Created-By: Packages' |
  awk '$1 == "Debian" && $2 == "main" && $3 ~ /^(http|https|file|ftp):/ && $3 !~ /security/ { print $3; exit }')
[ -n "$mirror" ] || fail "apt knows no Debian mirror; run 'apt-get update', or set BLENDER=/path/to/blender"

mkdir -p "$dir"
dir=$(cd "$dir" && pwd)

# Removes an unfinished folder; debootstrap may have left /proc and /sys mounted inside it.
discard() {
  for mount in proc sys; do umount "$1/$mount" 2>/dev/null || true; done
  rm -rf --one-file-system "$1"
}

# $1: suite. Leaves $dir/root complete, or absent.
install_suite() {
  staging=$dir/.staging-$1
  discard "$staging"
  echo "installing Blender from Debian $1 into $dir (about two minutes, 2 GB)"
  log=$dir/install-$1.log
  # No deb-src and no device nodes: only the files are used, from outside of the folder.
  debootstrap --variant=minbase "$1" "$staging" "$mirror" >"$log" 2>&1 || return 1
  # Downloads go through this machine's own apt settings (proxies).
  for setting in Acquire::http::Proxy Acquire::https::Proxy; do
    value=$(apt-config shell v "$setting" | sed "s/^v='\(.*\)'$/\1/")
    [ -z "$value" ] || echo "$setting \"$value\";" >>"$staging/etc/apt/apt.conf.d/90proxy"
  done
  cp /etc/resolv.conf "$staging/etc/resolv.conf" 2>/dev/null || true
  DEBIAN_FRONTEND=noninteractive chroot "$staging" \
    apt-get install -y --no-install-recommends blender python3-numpy \
    python3-cattr python3-requests libgl1 libglx-mesa0 libegl1 libgl1-mesa-dri >>"$log" 2>&1 || return 1
  chroot "$staging" apt-get clean
  rm -rf "$dir/root"
  mv "$staging" "$dir/root"
}

suite=${wanted:-sid}
if [ -x "$dir/root/usr/bin/blender" ]; then
  suite="as installed before"
elif [ -n "$wanted" ]; then
  if ! install_suite "$wanted"; then
    discard "$dir/.staging-$wanted"
    fail "Debian $wanted cannot be installed here, see $dir/install-$wanted.log"
  fi
elif ! install_suite sid; then
  echo "Debian unstable cannot be installed here (see $dir/install-sid.log); trying Debian 13's Blender 4.3" >&2
  discard "$dir/.staging-sid"
  suite=trixie
  if ! install_suite trixie; then
    discard "$dir/.staging-trixie"
    fail "Debian 13 failed too, see $dir/install-trixie.log; set BLENDER=/path/to/blender instead"
  fi
fi

# The loader and every library come from the folder, so the host's own versions do not matter.
cat >"$dir/run" <<'WRAPPER'
#!/bin/sh
# Runs a program below this folder with the folder's own libraries: run PROGRAM [ARGUMENT...]
here=$(cd "$(dirname "$(readlink -f "$0")")" && pwd)
root=$here/root
arch=$(basename "$(dirname "$(ls -d "$root"/usr/lib/*-linux-gnu*/libc.so.6)")")
lib=$root/usr/lib/$arch
loader=$(ls "$root"/usr/lib64/ld-linux-*.so.* "$lib"/ld-linux-*.so.* 2>/dev/null | head -n 1)
export PYTHONHOME="$root/usr" LIBGL_DRIVERS_PATH="$lib/dri"
unset PYTHONPATH
program=$root/usr/bin/$1
shift
exec "$loader" --library-path "$lib:$lib/blas:$lib/lapack:$lib/pulseaudio:$root/usr/lib" \
  "$program" "$@"
WRAPPER
cat >"$dir/blender" <<'WRAPPER'
#!/bin/sh
# Runs the Blender below this folder.
here=$(cd "$(dirname "$(readlink -f "$0")")" && pwd)
# For add-ons that start a second one.
export BLENDER="${BLENDER:-$here/blender}"
resources=$(ls -d "$here"/root/usr/share/blender/[0-9]* 2>/dev/null | head -n 1)
[ -n "$resources" ] || resources=$here/root/usr/share/blender
export BLENDER_SYSTEM_RESOURCES="$resources"
export BLENDER_SYSTEM_SCRIPTS="$resources/scripts"
export BLENDER_SYSTEM_DATAFILES="$resources/datafiles"
export BLENDER_SYSTEM_PYTHON="$here/python"
exec "$here/run" blender "$@"
WRAPPER
# Blender starts its Python by name, for example to install extensions.
mkdir -p "$dir/python/bin"
ln -sfn ../root/usr/lib "$dir/python/lib"
for python in "$dir"/root/usr/bin/python3.[0-9]*; do
  name=$(basename "$python")
  printf '#!/bin/sh\nexec "%s/run" %s "$@"\n' "$dir" "$name" >"$dir/python/bin/$name"
done
chmod +x "$dir/run" "$dir/blender" "$dir"/python/bin/*

version=$(version_of "$dir/blender")
[ -n "$version" ] || fail "$dir/blender does not start; try: $dir/blender --version"
echo "Blender $version (Debian, $suite) is ready: $dir/blender"
case "$version" in
  [0-4].*) echo "warning: this is older than 5.0; tests against Blender 5 need BLENDER=/path/to/a/newer/one" >&2 ;;
esac
