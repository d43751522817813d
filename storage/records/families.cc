// SPDX-License-Identifier: Apache-2.0
#include "storage/records/families.h"

#include <array>

namespace veduta {
namespace {

// Features are not compressed: zstd takes a quarter off (LZ4 a twentieth), but adds 0.4 ms to each
// of the dozens of reads that matching one new photo takes. JPEGs are compressed already. Sizes of
// write buffers were chosen by hand, larger where values are; not measured.
constexpr std::array<FamilyTraits, kFamilyCount> kFamilies = {{
    {.family = Family::kMeta, .name = "meta"},
    {.family = Family::kCameras, .name = "cameras"},
    {.family = Family::kNames, .name = "names"},
    {.family = Family::kHashes, .name = "hashes"},
    {.family = Family::kPhotos,
     .name = "photos",
     .store = ValueStore::kBlob,
     .write_buffer_mib = 64,
     .written_once = true,
     .scanned_in_long_runs = true},
    {.family = Family::kFeatures,
     .name = "features",
     .store = ValueStore::kBlob,
     .write_buffer_mib = 64,
     .written_once = true,
     .scanned_in_long_runs = true},
    {.family = Family::kImages, .name = "images", .scanned_in_long_runs = true},
    {.family = Family::kPairs, .name = "pairs", .write_buffer_mib = 32},
    {.family = Family::kReconstructions, .name = "reconstructions"},
    {.family = Family::kPoses, .name = "poses", .scanned_in_long_runs = true},
    {.family = Family::kObservations, .name = "observations", .scanned_in_long_runs = true},
    {.family = Family::kPoints,
     .name = "points",
     .write_buffer_mib = 32,
     .scanned_in_long_runs = true,
     .deletes_ranges = true},
    {.family = Family::kVocabulary, .name = "vocabulary", .store = ValueStore::kBlob},
    {.family = Family::kWords,
     .name = "words",
     .scanned_in_long_runs = true,
     .deletes_ranges = true},
    {.family = Family::kPostings,
     .name = "postings",
     .write_buffer_mib = 32,
     .unites_ids = true,
     .scanned_in_long_runs = true,
     .deletes_ranges = true},
    {.family = Family::kQueue, .name = "queue"},
    {.family = Family::kJournal, .name = "journal", .scanned_in_long_runs = true},
    {.family = Family::kDense,
     .name = "dense",
     .deletes_ranges = true,
     .digested_whole = true,
     .since_format = 2},
    {.family = Family::kDepth,
     .name = "depth",
     .store = ValueStore::kCompressedBlob,
     .write_buffer_mib = 64,
     .scanned_in_long_runs = true,
     .digested_whole = true,
     .since_format = 2},
    {.family = Family::kVolume,
     .name = "volume",
     .write_buffer_mib = 32,
     .scanned_in_long_runs = true,
     .deletes_ranges = true,
     .digested_whole = true,
     .since_format = 2},
    {.family = Family::kSurface,
     .name = "surface",
     .store = ValueStore::kCompressedBlob,
     .write_buffer_mib = 32,
     .scanned_in_long_runs = true,
     .deletes_ranges = true,
     .digested_whole = true,
     .since_format = 2},
    {.family = Family::kUploads,
     .name = "uploads",
     .store = ValueStore::kBlob,
     .write_buffer_mib = 32,
     .written_once = true,
     .since_format = 4},
    {.family = Family::kContributions, .name = "contributions", .since_format = 7},
}};

constexpr bool LiesByNumber() {
  for (size_t i = 0; i < kFamilies.size(); ++i) {
    if (static_cast<size_t>(kFamilies[i].family) != i) return false;
  }
  return true;
}
static_assert(LiesByNumber(), "a family's number is its place in the table");

}  // namespace

std::span<const FamilyTraits, kFamilyCount> AllFamilies() {
  return kFamilies;
}

const FamilyTraits& TraitsOf(Family family) {
  return kFamilies[static_cast<size_t>(family)];
}

std::optional<Family> FindFamily(std::string_view name) {
  for (const FamilyTraits& traits : kFamilies) {
    if (name == traits.name) return traits.family;
  }
  return std::nullopt;
}

}  // namespace veduta
