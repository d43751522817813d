#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds, and runs all tests; with `tidy` runs clang-tidy instead, over
# all that the preset dev compiles or over the files named.
# usage: tools/test.sh [PRESET]        (default: dev)
#        tools/test.sh tidy [FILE...]
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${1:-dev}
if [ "$preset" = tidy ]; then
  shift
  exec tools/clang_tidy.sh "$@"
fi
case "$preset" in
  asan | tsan) tools/install.sh --dev ;; # their compiler is clang
  *) tools/install.sh ;;
esac
cmake --preset "$preset"
cmake --build --preset "$preset"
ctest --preset "$preset" --parallel "$(nproc)"
