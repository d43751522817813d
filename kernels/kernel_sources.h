// SPDX-License-Identifier: Apache-2.0
#pragma once
// The .cl files of this folder, embedded by CMake.

#include <span>
#include <string_view>

namespace veduta {

struct KernelSource {
  std::string_view file;  // "scale.cl"
  std::string_view text;
};

// All of them, by name.
std::span<const KernelSource> KernelSources();

}  // namespace veduta
