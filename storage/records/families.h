// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one list of the column families: what each is called, and what is special about it.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace veduta {

// The numbers are fed to the digest: never renumbered, and a new family takes the next one.
enum class Family : uint8_t {
  kMeta = 0,
  kCameras = 1,
  kNames = 2,
  kHashes = 3,
  kPhotos = 4,
  kFeatures = 5,
  kImages = 6,
  kPairs = 7,
  kReconstructions = 8,
  kPoses = 9,
  kObservations = 10,
  kPoints = 11,
  kVocabulary = 12,
  kWords = 13,
  kPostings = 14,
  kQueue = 15,
  kJournal = 16,
  kDense = 17,
  kDepth = 18,
  kVolume = 19,
  kSurface = 20,
  kUploads = 21,
  kContributions = 22,
};
inline constexpr size_t kFamilyCount = 23;

// How RocksDB keeps the values of a family.
enum class ValueStore : uint8_t {
  kTable,           // beside their keys
  kBlob,            // in blob files: never merged with others, so compactions leave them alone
  kCompressedBlob,  // in blob files, by zstd
};

struct FamilyTraits {
  Family family;
  const char* name;  // stored: never renamed
  ValueStore store = ValueStore::kTable;
  uint32_t write_buffer_mib = 8;
  // Keys are written once and hardly ever deleted, so blob files hold next to no garbage: they are
  // never copied to be rid of it. A blob file goes when nothing in it is needed any more.
  bool written_once = false;
  // Values are ascending arrays of u32, each number once, and a write may be an array to unite
  // with.
  bool unites_ids = false;
  // Grows with the city, and is scanned in long runs: what a scan reads is not kept in the cache,
  // where it would push out what other reads need.
  bool scanned_in_long_runs = false;
  // Runs of keys are deleted at once, as a range. It costs a second look at what is scanned
  // (storage/value_reader.h).
  bool deletes_ranges = false;
  // The digest takes every key and value as it lies. The other families enter it record by record.
  bool digested_whole = false;
  uint32_t since_format = 1;  // of the database, which has the family from then on
};

// In the order of their numbers.
std::span<const FamilyTraits, kFamilyCount> AllFamilies();
const FamilyTraits& TraitsOf(Family family);
inline const char* FamilyName(Family family) {
  return TraitsOf(family).name;
}
std::optional<Family> FindFamily(std::string_view name);

}  // namespace veduta
