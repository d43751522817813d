#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Kills `veduta add` at random instants, again and again, and checks that nothing acknowledged is
# ever lost, that the database is sound after every kill, and that the city ends up the same to the
# last bit as without any kill. Some photos are sent twice, in both orders: under a wrong camera,
# under another camera of the same size, or under a name that is taken. Then as many kills of what
# changes a city that is there: remove, forbid, allow and settle. This prepares the photos;
# tools/kill_test.py, tools/kill_changes.py and tools/kill_unnamed.py do the killing.
# usage: tools/kill_test.sh [KILLS] [FOLDER OF PHOTOS, with camera.txt in it or one above]
#   default: 200 kills over a rendered street of 30 small photos
# environment: VEDUTA_BUILD  build tree to take the programs from
#                            (default: build/release, else build/dev)
#              SEED          of the instants                        (default: 1)
#              PHOTOS        how many photos to render              (default: 30)
#              UNNAMED       if set, photos without cameras as well (default: not set)
# Exit codes: 0 all held; 1 something did not; 2 bad usage.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
kills=${1:-200}
photos=${2:-}
if ! [[ $kills =~ ^[0-9]+$ ]]; then
  echo "usage: tools/kill_test.sh [KILLS] [FOLDER OF PHOTOS]" >&2
  exit 2
fi
build=${VEDUTA_BUILD:-}
for tree in "$root/build/release" "$root/build/dev"; do
  [ -z "$build" ] && [ -x "$tree/cli/veduta" ] && build=$tree
done
if ! [ -x "$build/cli/veduta" ]; then
  echo "kill_test.sh: build Veduta first, or set VEDUTA_BUILD" >&2
  exit 2
fi

work=$(mktemp -d "${TMPDIR:-/tmp}/veduta_kill_XXXXXX")
trap 'rm -rf "$work"' EXIT
if [ -z "$photos" ]; then
  "$build/tools/render/street/veduta-street" "$work/street" --photos "${PHOTOS:-30}" \
    --size 512x384 --quiet > "$work/street.log"
  photos=$work/street/photos
fi
[ -d "$photos" ] || { echo "kill_test.sh: there is no folder $photos" >&2; exit 2; }

"$root/tools/kill_test.py" "$build/cli/veduta" "$photos" "$work" "$kills" "${SEED:-1}"
"$root/tools/kill_changes.py" "$build/cli/veduta" "$photos" "$work" "$kills" "${SEED:-1}"
[ -z "${UNNAMED:-}" ] ||
  "$root/tools/kill_unnamed.py" "$build/cli/veduta" "$photos" "$work" "$kills" "${SEED:-1}"
