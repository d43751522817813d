#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the fuzz targets with clang and runs each under libFuzzer, one after the other, or those
# that are named. What makes one fail is left in build/fuzz/found: docs/fuzzing.md.
# usage: tools/fuzz.sh SECONDS [TARGET...]     TARGET: jpeg, records ...
set -euo pipefail
cd "$(dirname "$0")/.."
if [ $# -eq 0 ]; then
  echo "usage: tools/fuzz.sh SECONDS [TARGET...]" >&2
  exit 2
fi
seconds=$1
shift
build=build/fuzz
cmake --preset fuzz > "$build.log" || { cat "$build.log" >&2; exit 1; }
if [ $# -eq 0 ]; then
  cmake --build --preset fuzz
  mapfile -t targets < <(find "$build/tools/fuzz" -maxdepth 1 -type f -name 'veduta-fuzz-*' \
    -executable -printf '%f\n' | sed 's/^veduta-fuzz-//' | sort)
else
  targets=("${@//_/-}")
  cmake --build "$build" --target "${targets[@]/#/veduta-fuzz-}"
fi

# Targets with a database have it in memory, where there is such a file system: a removal of photos
# syncs every file, and on a busy disk it would look as if the daemon hung.
if [ -w /dev/shm ]; then export TMPDIR=/dev/shm; fi

failed=0
for target in "${targets[@]}"; do
  program="$build/tools/fuzz/veduta-fuzz-$target"
  seeds="$build/seeds/$target"
  corpus="$build/corpus/$target"
  found="$build/found/$target"
  log="$build/$target.log"
  mkdir -p "$corpus" "$found"
  VEDUTA_FUZZ_SEEDS="$seeds" "$program"
  # Leaks are left to the preset asan: a library's own at each exit would end every run.
  if ASAN_OPTIONS="detect_leaks=0:allocator_may_return_null=1" \
    "$program" -max_total_time="$seconds" -timeout=25 -rss_limit_mb=2560 -max_len=65536 \
    -print_final_stats=1 -artifact_prefix="$found/" "$corpus" "$seeds" > "$log" 2>&1; then
    result="nothing found"
  else
    result="FAILED: see $log and $found"
    failed=1
  fi
  runs=$(sed -n 's/^stat::number_of_executed_units: //p' "$log")
  coverage=$(grep -oE 'cov: [0-9]+' "$log" | tail -n 1 || true)
  echo "$target: ${runs:-?} runs, ${coverage:-cov: ?}, $result"
done
exit "$failed"
