// SPDX-License-Identifier: Apache-2.0
#pragma once
// Walks over all records of a family, for the checks: a value that cannot be read is a violation,
// and the walk goes on behind it.

#include <string>
#include <string_view>
#include <vector>

#include "engine/query/violations.h"
#include "storage/database.h"
#include "storage/records/families.h"
#include "storage/records/write_ahead_mark.h"

namespace veduta {

// Entries whose key says something that no record of storage/model holds.
struct NameEntry {
  PhotoName name;
  ImageId image;
};
struct HashEntry {
  ContentHash photo;
  ImageId image;
};
struct FeaturesEntry {
  ContentHash photo;
  Features features;
};
struct PairRow {
  bool is_neighbor = false;  // one direction of a pair: `image` and `neighbor`; else `pair`
  ImageId image;
  PairNeighbor neighbor;
  PairRecord pair;
};
struct ObservationsEntry {
  ImageId image;
  std::vector<Observation> observations;
};
struct PointsEntry {
  ReconstructionId reconstruction;
  uint32_t generation = 0;
  PointBlock block;
};
struct WordsEntry {
  uint32_t generation = 0;
  ImageId image;
  std::vector<WordId> words;
};
struct PostingsEntry {
  uint32_t generation = 0;
  WordId word = 0;
  std::vector<ImageId> images;
};

// Each reads one entry of its family; kCorruption, without family and key, where it cannot.
Status ReadStored(std::string_view key, std::string_view value, CameraRecord* camera);
Status ReadStored(std::string_view key, std::string_view value, NameEntry* entry);
Status ReadStored(std::string_view key, std::string_view value, HashEntry* entry);
Status ReadStored(std::string_view key, std::string_view value, FeaturesEntry* entry);
Status ReadStored(std::string_view key, std::string_view value, ImageRecord* image);
Status ReadStored(std::string_view key, std::string_view value, PairRow* row);
Status ReadStored(std::string_view key, std::string_view value, ReconstructionRecord* record);
Status ReadStored(std::string_view key, std::string_view value, PoseRecord* pose);
Status ReadStored(std::string_view key, std::string_view value, ObservationsEntry* entry);
Status ReadStored(std::string_view key, std::string_view value, PointsEntry* entry);
Status ReadStored(std::string_view key, std::string_view value, WordsEntry* entry);
Status ReadStored(std::string_view key, std::string_view value, PostingsEntry* entry);
Status ReadStored(std::string_view key, std::string_view value, WriteAheadMark* mark);
Status ReadStored(std::string_view key, std::string_view value, JournalRecord* record);

inline std::string_view TextOf(const StoredBytes& value) {
  return {reinterpret_cast<const char*>(value.bytes().data()), value.bytes().size()};
}
// "family F, key K", as errors of storage/ name them.
std::string PlaceOf(Family family, std::string_view key);

// Calls visit(key, value) on every entry of a family that can be read at all, until `violations`
// are full. An entry or a table that is damaged is a violation; another failure is returned.
template <typename Visit>
Status WalkStored(const Snapshot& snapshot, Family family, Violations* violations, Visit&& visit) {
  const Status scanned =
      snapshot.ScanStored(family, [&](std::string_view key, const Result<StoredBytes>& value) {
        if (value.ok()) {
          visit(key, TextOf(*value));
        } else {
          violations->Add(value.status().message());
        }
        return !violations->full();
      });
  return violations->Note(scanned);
}

// Calls visit(record) on every record of the family that ReadStored reads.
template <typename Record, typename Visit>
Status WalkRecords(const Snapshot& snapshot, Family family, Violations* violations, Visit&& visit) {
  return WalkStored(snapshot, family, violations,
                    [&](std::string_view key, std::string_view value) {
                      Record record;
                      const Status read = ReadStored(key, value, &record);
                      if (read.ok()) {
                        visit(record);
                      } else {
                        violations->Add(PlaceOf(family, key) + ": " + read.message());
                      }
                    });
}

}  // namespace veduta
