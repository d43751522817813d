#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the program, and makes a Debian package of it: build/release/veduta_VERSION_ARCH.deb.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
tools/install.sh
cmake --preset release
cmake --build --preset release --target veduta
cd build/release
cpack
