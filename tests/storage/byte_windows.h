// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether any part of some bytes lies in any file of a folder.

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace veduta {

// All runs of 64 bytes of some contents.
class ByteWindows final {
 public:
  static constexpr size_t kSize = 64;

  void Add(std::span<const uint8_t> bytes) {
    for (size_t i = 0; i + kSize <= bytes.size(); ++i) {
      const std::string window(reinterpret_cast<const char*>(bytes.data()) + i, kSize);
      by_start_.emplace(StartOf(window.data()), window);
    }
  }

  // The files below `folder` that have one, each once.
  std::vector<std::string> FilesWithOne(const std::string& folder) const {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path(), std::ios::binary);
      const std::string text((std::istreambuf_iterator<char>(file)), {});
      if (HasOne(text)) found.push_back(entry.path().filename().string());
    }
    return found;
  }

 private:
  static uint64_t StartOf(const char* at) {
    uint64_t start = 0;
    std::memcpy(&start, at, sizeof(start));
    return start;
  }

  bool HasOne(const std::string& text) const {
    for (size_t i = 0; i + kSize <= text.size(); ++i) {
      const auto [begin, end] = by_start_.equal_range(StartOf(text.data() + i));
      for (auto it = begin; it != end; ++it) {
        if (std::memcmp(text.data() + i, it->second.data(), kSize) == 0) return true;
      }
    }
    return false;
  }

  std::unordered_multimap<uint64_t, std::string> by_start_;
};

}  // namespace veduta
