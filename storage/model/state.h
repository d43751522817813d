// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one record that changes with almost every transaction.

#include <cstdint>
#include <optional>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

// How many records there are. Not part of the digest.
struct DatabaseCounts {
  uint64_t images = 0;                               // of all verdicts
  uint64_t placed = 0, postponed = 0, rejected = 0;  // placed: merged and founded ones too
  uint64_t cameras = 0;
  uint64_t located = 0;  // images that say where they were taken
  bool operator==(const DatabaseCounts&) const = default;
};

// Counters and switches that change with almost every transaction. As it stands here, that of an
// empty database.
struct DatabaseState {
  uint32_t next_image = 1;
  uint32_t next_camera = 1;
  uint32_t next_reconstruction = 1;
  uint64_t next_journal = 1;
  uint64_t next_blob = 1;
  uint32_t vocabulary_generation = 0;    // 0: none yet
  uint32_t images_at_vocabulary = 0;     // count of retrievable images when it was trained
  bool vocabulary_imported = false;      // given by a person: not re-trained
  uint32_t retrievable_image_count = 0;  // images with features, N of eq 5
  std::vector<ImageId>
      pending_propagation;  // placed views whose neighbors are still to be tried, oldest first
  // Photos were removed, and the files have not been rewritten without their bytes since
  // (Database::PurgeDeleted). No part of the digest.
  bool removed_bytes_left = false;
  // Kept by Transaction::Commit, whatever was given to PutState. None in a state that was written
  // by a program that did not count yet: see Snapshot::GetCounts.
  std::optional<DatabaseCounts> counts = DatabaseCounts{};
  bool operator==(const DatabaseState&) const = default;
};

}  // namespace veduta
