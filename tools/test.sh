#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds, and runs all tests. usage: tools/test.sh [PRESET]   (default: dev)
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${1:-dev}
tools/install.sh
cmake --preset "$preset"
cmake --build --preset "$preset"
ctest --preset "$preset" --parallel "$(nproc)"
