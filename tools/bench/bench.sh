#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the release and measures it on the photographs with ground truth.
# usage: tools/bench/bench.sh [OPTIONS OF bench.py]
# VEDUTA_DATA is the folder of data sets (default ../shared/data); VEDUTA_SCORER is the scorer of
# poses.
set -euo pipefail
cd "$(dirname "$0")/../.."
data=${VEDUTA_DATA:-../shared/data}
scorer=${VEDUTA_SCORER:-../shared/tools/score_poses.py}
tools/install.sh
cmake --preset release
cmake --build --preset release
for set in fountain-P11 castle-P19; do
  tools/bench/bench.py "$data/strecha/$set" --camera 1536x1024,1379.74,1382.08,760.095,503.155 \
    --truth "$data/strecha/$set/truth" --scorer "$scorer" --out docs/benchmarks.md "$@"
done
