#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Goal: a disk that takes no more is exit code 1 and a message that names the file and the cause,
#   not a death by signal; the database opens again, is sound, and the same command once more makes
#   the city that a roomy disk makes.
# Method: the shell's limit on a file's size stands for the full disk: it needs no other user's
#   rights.
# usage: full_disk_test.sh VEDUTA VEDUTA-STREET
set -euo pipefail
veduta=$1 street=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/veduta_full_XXXXXX")
trap 'rm -rf "$work"' EXIT

fail() { echo "FAILED: $*" >&2; exit 1; }
new_database() {
  "$veduta" init "$1" > /dev/null
  "$veduta" camera add "$1" c --size 512x384 --params 450.56,450.56,255.5,191.5 > /dev/null
}
add() { "$veduta" add "$1" --camera c "$work/street/photos" --threads 2; }

"$street" "$work/street" --photos 6 --size 512x384 --quiet > /dev/null
new_database "$work/roomy"
add "$work/roomy" > /dev/null 2>&1 || fail "add with room ended with $?"

new_database "$work/full"
code=0
(ulimit -f 1600; add "$work/full") > "$work/out" 2> "$work/err" || code=$?
cat "$work/err"
[ "$code" = 1 ] || fail "add without room ended with $code"
grep -q "full/.*File too large" "$work/err" || fail "the message names no file, or no cause"
acknowledged=$(wc -l < "$work/out")
[ "$acknowledged" -ge 1 ] && [ "$acknowledged" -lt 6 ] ||
  fail "$acknowledged of 6 photos fitted in: the limit shows nothing"

"$veduta" verify "$work/full"
add "$work/full" > "$work/again" 2>&1 || fail "add once there is room ended with $?"
duplicates=$(grep -c '^duplicate' "$work/again")
[ "$duplicates" -ge "$acknowledged" ] ||
  fail "$acknowledged photos were acknowledged, $duplicates are there"
[ "$("$veduta" digest "$work/full")" = "$("$veduta" digest "$work/roomy")" ] ||
  fail "the digests differ"
# With less, RocksDB's own log would be cut off, too, or the database does not even open.
for limit in 1 8 30 100 400; do
  new_database "$work/full_$limit"
  code=0
  (ulimit -f "$limit"; add "$work/full_$limit") > "$work/out" 2> "$work/err" || code=$?
  [ "$code" = 1 ] || fail "add with files of $limit KB ended with $code: $(cat "$work/err")"
  grep -q "File too large" "$work/err" || fail "at $limit KB the message names no cause"
  add "$work/full_$limit" > "$work/again" 2>&1 || fail "add after $limit KB ended with $?"
  [ "$("$veduta" digest "$work/full_$limit")" = "$("$veduta" digest "$work/roomy")" ] ||
    fail "the digests differ after $limit KB"
done
echo "$acknowledged of 6 photos before the disk was full, and the same city after"
