#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs reader processes in loops beside processes that write, and counts the readers that fail. Each
# photo is added by a process of its own: opening for writing makes tables of the log and merges
# them, so files are deleted all the time.
# usage: tools/readers_beside_writer.sh FOLDER_OF_PHOTOS WxH fx,fy,cx,cy [READERS] [SECONDS]
#   default: 50 readers, 600 seconds; the photos (JPEG) are added again and again, to new databases
#   beside the first one once all are in
# environment: VEDUTA  the program (default: build/release/cli/veduta, else build/dev/cli/veduta)
# Exit codes: 0 no reader failed; 1 one did; 2 bad usage.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
if [ $# -lt 3 ] || ! [ -d "$1" ]; then
  usage="FOLDER_OF_PHOTOS WxH fx,fy,cx,cy [READERS] [SECONDS]"
  echo "usage: tools/readers_beside_writer.sh $usage" >&2
  exit 2
fi
photos=$1 size=$2 params=$3 readers=${4:-50} seconds=${5:-600}
veduta=${VEDUTA:-}
for build in release dev; do
  [ -z "$veduta" ] && [ -x "$root/build/$build/cli/veduta" ] && veduta=$root/build/$build/cli/veduta
done
if [ -z "$veduta" ]; then
  echo "readers_beside_writer.sh: build Veduta first, or set VEDUTA" >&2
  exit 2
fi

work=$(mktemp -d "${TMPDIR:-/tmp}/veduta_readers_XXXXXX")
trap 'rm -rf "$work"' EXIT
new_database() {
  "$veduta" init "$1" >"$work/init" 2>&1
  "$veduta" camera add "$1" c --size "$size" --params "$params" >"$work/init" 2>&1
}
new_database "$work/db1"
echo "$work/db1" >"$work/current"
end=$((SECONDS + seconds))

# A reader: status, digest and journal in turns, each of the database of the moment.
read_loop() {
  local name=$1 turn=0 database
  while [ $SECONDS -lt $end ]; do
    database=$(cat "$work/current")
    case $((turn++ % 3)) in
      0) command=(status "$database" --json) ;;
      1) command=(digest "$database") ;;
      2) command=(journal "$database") ;;
    esac
    if "$veduta" "${command[@]}" >"$work/out.$name" 2>"$work/err.$name"; then
      echo "${command[0]}" >>"$work/done.$name"
    else
      echo "${command[0]}: $(head -c 400 "$work/err.$name")" >>"$work/failed.$name"
    fi
  done
}
for i in $(seq "$readers"); do read_loop "$i" & done

count=0 databases=1
while [ $SECONDS -lt $end ]; do
  for photo in "$photos"/*.[jJ][pP]*[gG]; do
    [ $SECONDS -lt $end ] || break
    if "$veduta" add "$(cat "$work/current")" "$photo" --camera c >"$work/add" 2>&1; then
      count=$((count + 1))
    else
      echo "add failed: $(tail -n 1 "$work/add")" >>"$work/failed.writer"
    fi
  done
  databases=$((databases + 1))
  new_database "$work/db$databases"
  echo "$work/db$databases" >"$work/next" && mv "$work/next" "$work/current"
done
wait

touch "$work/done.none" "$work/failed.none"
reads=$(cat "$work"/done.* | wc -l)
failures=$(cat "$work"/failed.* | wc -l)
echo "$count photos added to $databases databases; $reads readings, $failures failures"
cat "$work"/failed.* | sort | uniq -c | sort -rn | head -n 10
[ "$failures" -eq 0 ]
