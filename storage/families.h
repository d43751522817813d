// SPDX-License-Identifier: Apache-2.0
#pragma once
// The column families and how RocksDB keeps each. Names are stored: never renamed. Order is by use,
// not stored.

#include <rocksdb/cache.h>
#include <rocksdb/options.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace veduta {

enum class Family : uint8_t {
  kMeta,
  kCameras,
  kNames,
  kHashes,
  kPhotos,
  kFeatures,
  kImages,
  kPairs,
  kReconstructions,
  kPoses,
  kObservations,
  kPoints,
  kVocabulary,
  kWords,
  kPostings,
  kQueue,
  kJournal,
  kDense,
  kDepth,
  kVolume,
  kSurface,
};
inline constexpr size_t kFamilyCount = 21;

const char* FamilyName(Family family);
std::optional<Family> FindFamily(std::string_view name);

rocksdb::ColumnFamilyOptions FamilyOptions(Family family,
                                           const std::shared_ptr<rocksdb::Cache>& cache);
rocksdb::DBOptions DatabaseWideOptions();

}  // namespace veduta
