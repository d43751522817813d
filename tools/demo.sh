#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds, makes a database and fills it with photos.
# usage: tools/demo.sh [FOLDER OF PHOTOS]
# Without a folder it renders a small street. A folder brings its camera in camera.txt, in it or one
# above: the size, then `fx V fy V cx V cy V`, and where the lens distorts `k1 V k2 V [u0 V v0 V]`;
# or set VEDUTA_CAMERA='WxH fx,fy,cx,cy[,k1,k2[,u0,v0]]'.
set -euo pipefail
photos=${1:-}
if [ -n "$photos" ]; then
  [ -d "$photos" ] || { echo "demo.sh: there is no folder $photos" >&2; exit 1; }
  photos=$(cd "$photos" && pwd)
fi
cd "$(dirname "$0")/.."
tools/install.sh
cmake --preset release
cmake --build --preset release --target veduta veduta-street veduta-picture
bin=$PWD/build/release
out=$PWD/out/demo
rm -rf "$out"
mkdir -p "$out"

if [ -z "$photos" ]; then
  photos=$out/street/photos
  "$bin/tools/render/street/veduta-street" "$out/street" --photos 24
fi

camera=${VEDUTA_CAMERA:-$(tools/camera_text.py "$photos")}
if [ -z "$camera" ]; then
  echo "demo.sh: no camera: put camera.txt beside the photos," \
    "or set VEDUTA_CAMERA='WxH fx,fy,cx,cy'" >&2
  exit 1
fi
size=${camera% *}
params=${camera#* }

db=$out/city.veduta
"$bin/cli/veduta" init "$db"
"$bin/cli/veduta" camera add "$db" demo --size "$size" --params "$params"
# Photos only: a folder may hold other things beside them. Exit code 1 says that one was rejected,
# and which.
(cd "$photos" && find . -type f | sed 's|^\./||' | LC_ALL=C sort) |
  { grep -i -E '\.(jpe?g|png|tiff?)$' || true; } > "$out/photos.txt"
[ -s "$out/photos.txt" ] || { echo "demo.sh: $photos holds no photos" >&2; exit 1; }
"$bin/cli/veduta" add "$db" --camera demo --list "$out/photos.txt" "$photos" || [ $? -eq 1 ]
"$bin/cli/veduta" status "$db"
"$bin/cli/veduta" verify "$db"
"$bin/cli/veduta" export "$db" "$out/model" --format colmap
echo "database: $db"
if [ ! -d "$out/model/0" ]; then
  echo "demo.sh: no three photos fit together, so there is no model; is the camera right?" >&2
  exit 1
fi
"$bin/tools/render/picture/veduta-picture" "$out/model/0" "$out/model.png"
"$bin/cli/veduta" densify "$db"
"$bin/cli/veduta" export "$db" "$out/surface" --format gltf
for side in front left right; do
  "$bin/cli/veduta" render "$db" "$out/$side.png" --side "$side"
done
echo "model:    $out/model"
echo "surface:  $out/surface"
echo "pictures: $out/model.png $out/front.png $out/left.png $out/right.png"
