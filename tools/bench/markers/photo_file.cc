// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/markers/photo_file.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace veduta::floor {

namespace fs = std::filesystem;

std::vector<uint8_t> ReadBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

DecodedPhoto ReadPhoto(const std::string& path) {
  return DecodePhoto(ReadBytes(path), {});
}

std::vector<std::string> PhotosBelow(const std::vector<std::string>& paths) {
  std::vector<std::string> photos;
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      photos.push_back(path);
      continue;
    }
    const size_t first = photos.size();
    for (const auto& entry : fs::recursive_directory_iterator(path, error)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".jpg" || extension == ".png") photos.push_back(entry.path().string());
    }
    std::sort(photos.begin() + static_cast<ptrdiff_t>(first), photos.end());
  }
  return photos;
}

}  // namespace veduta::floor
