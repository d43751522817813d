#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds, makes a database and fills it with photos.
# usage: tools/demo.sh [FOLDER OF PHOTOS]
# Without a folder it renders a small street. A folder brings its camera in camera.txt, in it or one above: the size,
# then `fx V fy V cx V cy V`, and where the lens distorts `k1 V k2 V [u0 V v0 V]`; or set
# VEDUTA_CAMERA='WxH fx,fy,cx,cy[,k1,k2[,u0,v0]]'.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/install.sh
cmake --preset release
cmake --build --preset release
bin=$PWD/build/release
out=$PWD/out/demo
rm -rf "$out"
mkdir -p "$out"

photos=${1:-}
if [ -z "$photos" ]; then
  photos=$out/street/photos
  "$bin/tools/street/veduta-street" "$out/street" --photos 24
fi
[ -d "$photos" ] || { echo "demo.sh: there is no folder $photos" >&2; exit 1; }

# "WxH fx,fy,cx,cy[,k1,k2[,u0,v0]]" from camera.txt, whose first two whole numbers are the size.
camera=${VEDUTA_CAMERA:-}
for file in "$photos/camera.txt" "$photos/../camera.txt"; do
  [ -z "$camera" ] && [ -f "$file" ] || continue
  camera=$(python3 - "$file" <<'PY'
import re, sys
text = open(sys.argv[1]).read()
size = re.search(r'\b(\d+)\s*[x\s]\s*(\d+)\b', text)
got = dict(re.findall(r'\b(fx|fy|cx|cy|k1|k2|u0|v0)\b\s*[=:]?\s*(-?[0-9.]+(?:[eE][-+]?[0-9]+)?)', text))
names = ['fx', 'fy', 'cx', 'cy'] + (['k1', 'k2'] if 'k1' in got else []) + (['u0', 'v0'] if 'u0' in got else [])
if size and all(n in got for n in names):
    print(f"{size[1]}x{size[2]} " + ','.join(got[n] for n in names))
PY
)
done
if [ -z "$camera" ]; then
  echo "demo.sh: no camera: put camera.txt beside the photos, or set VEDUTA_CAMERA='WxH fx,fy,cx,cy'" >&2
  exit 1
fi
size=${camera% *}
params=${camera#* }

db=$out/city.veduta
"$bin/cli/veduta" init "$db"
"$bin/cli/veduta" camera add "$db" demo --size "$size" --params "$params"
"$bin/cli/veduta" add "$db" --camera demo "$photos" || true   # files that are no photos are named, and passed over
"$bin/cli/veduta" status "$db"
"$bin/cli/veduta" verify "$db"
"$bin/cli/veduta" export "$db" "$out/model" --format colmap
"$bin/tools/picture/veduta-picture" "$out/model/0" "$out/model.png"
echo "database: $db"
echo "model:    $out/model"
echo "picture:  $out/model.png"
