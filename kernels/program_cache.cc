// SPDX-License-Identifier: Apache-2.0
#include "kernels/program_cache.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr std::string_view kMagic = "VDCL1\n";

ContentHash HashOf(std::span<const unsigned char> bytes) {
  return HashContent(bytes);
}

// A name that no other writer uses, in this process or another.
std::string TemporaryName(const std::string& path) {
  static std::atomic<uint64_t> count = 0;
  return path + "." + std::to_string(getpid()) + "." + std::to_string(count++) + ".tmp";
}

}  // namespace

std::string ProgramCache::PathOf(std::string_view key) const {
  if (folder_.empty()) return {};
  ContentHasher hasher;
  hasher.Add(key);
  return (std::filesystem::path(folder_) / (hasher.Finish().Hex() + ".clbin")).string();
}

std::optional<std::vector<unsigned char>> ProgramCache::Find(std::string_view key) const {
  if (folder_.empty()) return std::nullopt;
  std::ifstream file(PathOf(key), std::ios::binary);
  if (!file) return std::nullopt;
  const std::vector<unsigned char> bytes((std::istreambuf_iterator<char>(file)),
                                         std::istreambuf_iterator<char>());
  ContentHash hash;
  const size_t header = kMagic.size() + hash.bytes.size();
  if (bytes.size() <= header || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin()))
    return std::nullopt;
  std::copy_n(bytes.begin() + static_cast<ptrdiff_t>(kMagic.size()), hash.bytes.size(),
              hash.bytes.begin());
  std::vector<unsigned char> binary(bytes.begin() + static_cast<ptrdiff_t>(header), bytes.end());
  if (HashOf(binary) != hash) return std::nullopt;
  return binary;
}

void ProgramCache::Keep(std::string_view key, const std::vector<unsigned char>& binary) const {
  if (folder_.empty() || binary.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  const std::string path = PathOf(key), temporary = TemporaryName(path);
  const ContentHash hash = HashOf(binary);
  std::ofstream file(temporary, std::ios::binary);
  file.write(kMagic.data(), static_cast<std::streamsize>(kMagic.size()));
  file.write(reinterpret_cast<const char*>(hash.bytes.data()),
             static_cast<std::streamsize>(hash.bytes.size()));
  file.write(reinterpret_cast<const char*>(binary.data()),
             static_cast<std::streamsize>(binary.size()));
  file.close();
  if (file.good()) std::filesystem::rename(temporary, path, error);
  if (!file.good() || error) std::filesystem::remove(temporary, error);
}

}  // namespace veduta
