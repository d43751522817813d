// SPDX-License-Identifier: Apache-2.0
#pragma once
// Carries out the work that follows from stored photos, each step a transaction of its own.

#include <vector>

#include "engine/ingest/adjusted_whole.h"
#include "engine/ingest/doubt.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

// Tries a photo without a pose once more by its stored pairs, and takes it off the photos that
// wait. Does only the latter where the photo has got a pose since. Returns the images that got a
// pose. After an error nothing is committed and the map may be half changed: the caller clears it.
Result<std::vector<ImageId>> RetryPhoto(const IngestParts& parts, ImageId image, WriteScope scope);

// Adjusts a whole reconstruction, and heals it where its evidence has turned: images that lose
// their poses wait again, parts that are split off become reconstructions of their own. One of
// which nothing is left is dissolved. After an error nothing is visible and the map may be half
// changed: the caller clears it.
Result<AdjustedWhole> AdjustWhole(const IngestParts& parts, ReconstructionId reconstruction,
                                  WriteScope scope);

// The second half of that: writes and commits what AdjustReconstruction has made of the whole
// reconstruction in the map. Nothing may have changed it in the database since it was read.
Result<AdjustedWhole> WriteAdjustedWhole(const IngestParts& parts, ReconstructionId reconstruction,
                                         const Healing& healing, WriteScope scope);

}  // namespace veduta
