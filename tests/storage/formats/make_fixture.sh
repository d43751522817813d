#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the fixture of one format: a small database that the binary of that time wrote.
# usage: tests/storage/formats/make_fixture.sh VEDUTA VEDUTA_STREET NAME [SIZE]
#   Writes NAME.tar.gz (the folder `city`, and `more` with one photo that the city does not hold)
#   and NAME.json (what the binary said of the city: digest and status) next to this script.
#
# How the stored fixtures were made. Each binary is built from the commit named, preset release,
# targets `veduta` and `veduta-street`; the photos of both come from the veduta-street of 52adcdd,
# so that they hold the same photos.
#   format1  veduta of ca68e88, the last commit that wrote format 1
#   format2  veduta of 52adcdd, the last commit before the records were moved to one place each
#            (issue 10)
#   format3  veduta of ab8b436, the last commit before the family `uploads`, with the veduta-street
#            of that commit and SIZE 240x180: founding asks for more than in the days of format 2
#   format4  veduta and veduta-street of febfadc, the last commit before places on the earth, with
#            SIZE 240x180
#   format5  veduta and veduta-street of 0861809, the last commit before merges that are open, with
#            SIZE 240x180, preset dev
#   format6  veduta and veduta-street of 92412d6, the last commit before contributions, with SIZE
#            240x180, preset dev
# Needs Linux namespaces (unshare): RocksDB writes the name of the machine into its tables, so the
# binaries run on a machine that is called `fixture`.
set -euo pipefail
if [ "${VEDUTA_FIXTURE_INSIDE:-}" != 1 ]; then
  export VEDUTA_FIXTURE_INSIDE=1
  exec unshare --user --map-root-user --uts bash -c 'hostname fixture && exec "$0" "$@"' "$0" "$@"
fi
[[ $# = 3 || $# = 4 ]] || { echo "usage: $0 VEDUTA VEDUTA_STREET NAME [SIZE]" >&2; exit 2; }
veduta=$(realpath "$1")
street=$(realpath "$2")
here=$(cd "$(dirname "$0")" && pwd)
name=$3
size=${4:-160x120}
export USER=anna LOGNAME=anna
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

# Photos as small as still have enough features to be placed. 0001 is far from the
# others and blurred, so that it stays postponed and costs few bytes; 0016 to 0019 make a
# reconstruction; broken.jpg is rejected; 0020 is for later.
"$street" street --photos 24 --size "$size" --jpeg-quality 70 --quiet > /dev/null
"$street" fog --photos 24 --size "$size" --jpeg-quality 70 --blur 1.2 --quiet > /dev/null
mkdir -p first then more
cp fog/photos/photo0001.jpg first/
cp street/photos/photo0016.jpg first/
cp street/photos/photo00{17,18,19}.jpg then/
echo 'This is no photo.' > then/broken.jpg
cp street/photos/photo0020.jpg more/

"$veduta" init city
"$veduta" camera add city phone --size "$size" \
  --params "$(sed -n 's/^PARAMS //p' street/camera.txt)"
add() { "$veduta" add city --camera phone --threads 1 --contributor anna "$1"; }
add first
"$veduta" vocabulary train city  # from two photos, for the tree would be large otherwise
add then || [ $? = 1 ]           # 1: a photo was rejected
if "$veduta" --help | grep -qw densify; then
  # Coarse voxels, so that the surface is small. Four tenths of the photos' width is enough for one.
  "$veduta" densify city --size $((${size%x*} * 2 / 5)) --voxel 0.4 --device cpp --threads 1
fi
"$veduta" verify city

status=$("$veduta" status city --json)
digest=$("$veduta" digest city)
printf '{"digest": "%s",\n "status": %s}\n' "$digest" "$status" > "$here/$name.json"

# Adding photo 0020 is killed after its bytes and features were written ahead, before its commit:
# that leaves a mark in the family `queue`. The command waits where it says that 0016 is a
# duplicate, for nobody reads its output and the pipe is full; meanwhile the next photo is prepared.
mkfifo pipe
exec 3<> pipe
timeout 1 cat /dev/zero >&3 || true
"$veduta" add city --camera phone --threads 2 --contributor anna \
  first/photo0016.jpg more/photo0020.jpg >&3 2>&3 &
sleep 3
kill -KILL $!
wait $! 2> /dev/null || true
grep -aqF photo0020.jpg city/*.log ||
  { echo "nothing was written ahead" >&2; exit 1; }
[ "$("$veduta" digest city)" = "$digest" ] || { echo "photo 0020 was added" >&2; exit 1; }

# RocksDB does not need these files, and they name folders of one machine.
rm -f city/LOG* city/OPTIONS-* city/LOCK
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime=2026-01-01 -cf - city more |
  gzip -9n > "$here/$name.tar.gz"
if zcat "$here/$name.tar.gz" | grep -aqF -e "$folder" -e "$HOME/"; then
  echo "$name.tar.gz names a folder of this machine" >&2
  exit 1
fi
ls -l "$here/$name.tar.gz"
