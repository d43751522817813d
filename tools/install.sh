#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian packages listed in tools/packages that are missing; with --dev those in
# tools/packages-dev too. When none is missing it touches neither the network nor the system, so
# scripts may call it each time.
set -euo pipefail

folder="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
lists=("$folder/packages")
case "${1-}" in
  "") ;;
  --dev) lists+=("$folder/packages-dev") ;;
  *)
    echo "usage: tools/install.sh [--dev]" >&2
    exit 2
    ;;
esac

if ! command -v dpkg-query > /dev/null || ! command -v apt-get > /dev/null; then
  echo "tools/install.sh knows Debian (12, bookworm) and its relatives only," \
    "and this system has no apt-get." >&2
  echo "Install what ${lists[*]} name by your system's own means." >&2
  exit 1
fi

mapfile -t wanted < <(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "${lists[@]}" | sort -u)
# Whoever has node and npm from elsewhere keeps them: Debian's npm would not go beside them.
if command -v npm > /dev/null && { command -v node || command -v nodejs; } > /dev/null; then
  for i in "${!wanted[@]}"; do
    [[ "${wanted[$i]}" =~ ^(nodejs|npm)$ ]] && unset "wanted[$i]"
  done
fi
# dpkg-query fails if it knows nothing of a package: then that package is missing, which is what is
# asked.
format='${Package} ${db:Status-Status}\n'
installed="$(dpkg-query -W -f "$format" "${wanted[@]}" 2> /dev/null || true)"
missing=()
for package in "${wanted[@]}"; do
  grep -qxF "$package installed" <<< "$installed" || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  echo "all ${#wanted[@]} packages are installed"
  exit 0
fi

echo "installing: ${missing[*]}"
as_root=()
if [[ "$(id -u)" -ne 0 ]]; then
  if ! command -v sudo > /dev/null; then
    echo "installing takes root: run this as root, or install sudo" >&2
    exit 1
  fi
  as_root=(sudo)
fi
"${as_root[@]}" apt-get update
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y --no-install-recommends "${missing[@]}"
