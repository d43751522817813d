// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bytes by name in a folder of their own: what a database is to the dense pass, so that memory
// can be measured.

#include <cstdint>
#include <string>
#include <vector>

#include "fusion/volume/grid.h"

namespace veduta::fusion_benchmark {

class BlockFiles final {
 public:
  // A new folder under the system's temporary one; removed at the end.
  BlockFiles();
  ~BlockFiles();
  BlockFiles(const BlockFiles&) = delete;
  BlockFiles& operator=(const BlockFiles&) = delete;

  void Write(const std::string& name, const std::vector<uint8_t>& bytes);
  std::vector<uint8_t> Read(const std::string& name) const;  // empty if there is none

 private:
  std::string folder_;
};

std::string NameOf(const char* kind, const GridPlace& block);

}  // namespace veduta::fusion_benchmark
