#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs clang-tidy with the checks of .clang-tidy, on all processors, over everything that the preset
# dev compiles, or over the files named. Exit code 1: it has found something.
# usage: tools/clang_tidy.sh [FILE...]
set -euo pipefail
cd "$(dirname "$0")/.."
tools/install.sh
cmake --preset dev
# Headers that the build makes must be there before they are read.
ninja -C build/dev storage/records/schema.capnp.c++ kernels/kernel_sources.cc
files=()
for file in "$@"; do files+=("^$PWD/$file\$"); done
[ ${#files[@]} -gt 0 ] || files=("^$PWD/(storage|index|engine|kernels|fusion|cli|tools|tests)/")
run-clang-tidy-14 -quiet -p build/dev -j "$(nproc)" "${files[@]}"
