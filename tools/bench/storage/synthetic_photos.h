// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos and all that a placed photo adds to the database, of the usual sizes, from random numbers.

#include <cstdint>

#include "storage/base/status.h"
#include "storage/database.h"

namespace veduta::bench {

struct PhotoSizes {
  uint32_t photo_bytes = 250'000;  // a JPEG of 1536x1024
  uint32_t features = 1'500;       // about a third of those of such a photo, for the sake of time
  uint32_t neighbors = 15;         // verified pairs with the photos before
  uint32_t matches = 250;          // of each pair
  uint32_t points = 300;           // of the photo's own point block
  uint32_t touched_blocks = 8;     // point blocks of other photos that are written again
  uint32_t words = 1'200;          // distinct ones, of 100,000
};

// Writes photo `id` (from 1, ascending) as ingestion does: ahead, and then one commit.
Status AddSyntheticPhoto(Database& database, uint32_t id, const PhotoSizes& sizes);

}  // namespace veduta::bench
