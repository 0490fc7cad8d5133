#!/usr/bin/env bash
# Runs ./test.sh in a fresh Debian 13 (dolfinx 0.9): as root, on any Debian, with debootstrap installed.
#
#   scripts/debian13.sh [-k] [ARGUMENT…]     arguments go to pytest; -k keeps the system afterwards, and uses one kept
#
# The system takes about 4 GB below $FFROBOT_CHROOT (default /var/tmp/ffrobot-debian13). What is committed is tested.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly SYSTEM=${FFROBOT_CHROOT:-/var/tmp/ffrobot-debian13} MIRROR=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
readonly MOUNTS=(proc sys dev dev/pts dev/shm)

keep=
if [[ ${1:-} == -k ]]; then
  keep=yes
  shift
fi

die() {
  printf 'debian13: %s\n' "$1" >&2
  exit 1
}
((EUID == 0)) || die "needs root, for debootstrap and chroot"
command -v debootstrap >/dev/null || die "debootstrap is not installed: apt-get install debootstrap"

unmount() {
  local place
  for place in dev/shm dev/pts dev sys proc; do
    ! mountpoint -q "$SYSTEM/$place" || umount "$SYSTEM/$place"
  done
}
leave() {
  unmount
  # Only what this script has made, and only once nothing of this machine is mounted in it.
  if [[ -z $keep && -f $SYSTEM/ffrobot.chroot ]]; then
    rm -rf --one-file-system "$SYSTEM"
  fi
}
trap leave EXIT

if [[ ! -f $SYSTEM/ffrobot.chroot ]]; then
  [[ ! -e $SYSTEM ]] || die "$SYSTEM exists, and was not made by this script"
  debootstrap --variant=minbase --include=ca-certificates trixie "$SYSTEM" "$MIRROR"
  touch "$SYSTEM/ffrobot.chroot"
fi
for place in "${MOUNTS[@]}"; do
  mountpoint -q "$SYSTEM/$place" || mount --bind "/$place" "$SYSTEM/$place"
done
cp /etc/resolv.conf "$SYSTEM/etc/resolv.conf"
# How this machine reaches the network, and whom it trusts there.
for file in /etc/apt/apt.conf.d/*proxy* /etc/pip.conf /etc/ssl/certs/ca-certificates.crt; do
  [[ ! -f $file ]] || install -D -m 644 "$file" "$SYSTEM$file"
done

# A repository, for ruff leaves out what git does. One kept has its build and environment still.
copy=$SYSTEM/root/ffrobot
[[ -d $copy/.git ]] || git init -q "$copy"
git -C "$copy" fetch -q "$PWD" HEAD
git -C "$copy" checkout -q --force --detach FETCH_HEAD
git -C "$copy" clean -qfd
chroot "$SYSTEM" env -C /root/ffrobot HOME=/root LANG=C.UTF-8 ./test.sh "$@"
