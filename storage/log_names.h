// SPDX-License-Identifier: Apache-2.0
#pragma once
// The names of RocksDB's logs: a number of six digits or more, and ".log"; and of its manifests.

#include <rocksdb/file_system.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/status.h"
#include "storage/rocksdb_status.h"

namespace veduta {

inline std::string LogName(uint64_t number) {
  const std::string digits = std::to_string(number);
  return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits + ".log";
}

// The number of a file's name without its beginning or its end.
inline std::optional<uint64_t> ParseFileNumber(std::string_view digits) {
  uint64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return number;
}

inline std::optional<uint64_t> ParseLogName(std::string_view name) {
  if (!name.ends_with(".log")) return std::nullopt;
  name.remove_suffix(4);
  return ParseFileNumber(name);
}

inline std::optional<uint64_t> ParseManifestName(std::string_view name) {
  constexpr std::string_view kBegin = "MANIFEST-";
  if (!name.starts_with(kBegin)) return std::nullopt;
  return ParseFileNumber(name.substr(kBegin.size()));
}

// The numbers of the logs in a folder, ascending. kIoError.
inline Result<std::vector<uint64_t>> ListLogs(rocksdb::FileSystem& file_system,
                                              const std::string& folder) {
  std::vector<std::string> names;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(file_system.GetChildren(folder, rocksdb::IOOptions(), &names, nullptr),
                  "list folder " + folder));
  std::vector<uint64_t> logs;
  for (const std::string& name : names) {
    if (const std::optional<uint64_t> number = ParseLogName(name)) logs.push_back(*number);
  }
  std::sort(logs.begin(), logs.end());
  return logs;
}

}  // namespace veduta
