// SPDX-License-Identifier: Apache-2.0
#include "tools/fusion/block_files.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "storage/base/status.h"

namespace veduta::fusion_benchmark {

BlockFiles::BlockFiles() {
  std::string pattern = (std::filesystem::temp_directory_path() / "veduta_fusion_XXXXXX").string();
  VEDUTA_CHECK(mkdtemp(pattern.data()) != nullptr, pattern);
  folder_ = pattern;
}

BlockFiles::~BlockFiles() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

void BlockFiles::Write(const std::string& name, const std::vector<uint8_t>& bytes) {
  std::ofstream file(folder_ + "/" + name, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  VEDUTA_CHECK(file.good(), folder_ + "/" + name);
}

std::vector<uint8_t> BlockFiles::Read(const std::string& name) const {
  std::ifstream file(folder_ + "/" + name, std::ios::binary | std::ios::ate);
  if (!file) return {};
  std::vector<uint8_t> bytes(static_cast<size_t>(file.tellg()));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

std::string NameOf(const char* kind, const GridPlace& block) {
  return std::string(kind) + "_" + std::to_string(block.x) + "_" + std::to_string(block.y) + "_" +
         std::to_string(block.z);
}

}  // namespace veduta::fusion_benchmark
