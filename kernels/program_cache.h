// SPDX-License-Identifier: Apache-2.0
#pragma once
// Built programs on disk, by a key that names everything that they depend on.
//
// A file is named by the key's SHA-256 and holds the bytes "VDCL1\n", the SHA-256 of the rest (32
// bytes) and the driver's binary. Anything else under that name counts as absent and is written
// over.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace veduta {

// Thread-safe, also between processes: a file appears whole or not at all. No call fails: what
// cannot be read counts as absent, and what cannot be written is not kept.
class ProgramCache final {
 public:
  ProgramCache() = default;  // keeps nothing
  explicit ProgramCache(std::string folder) : folder_(std::move(folder)) {}

  std::optional<std::vector<unsigned char>> Find(std::string_view key) const;
  void Keep(std::string_view key, const std::vector<unsigned char>& binary) const;
  // Where the program of that key lies; empty if nothing is kept.
  std::string PathOf(std::string_view key) const;

 private:
  std::string folder_;
};

}  // namespace veduta
