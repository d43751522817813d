// SPDX-License-Identifier: Apache-2.0
#pragma once
// A stored photo gets the bytes of a larger copy of it, in one transaction with everything that is
// derived from them.

#include <memory>
#include <span>
#include <string>

#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

// The larger copy, as it would be stored by itself.
struct BetterVersion {
  const ImageRecord& record;  // its camera is stored, or is by this transaction
  const CameraModel& camera;
  const ImageFeatures& features;
  std::shared_ptr<const Features> extracted;  // where the camera's extraction_model has them
  std::span<const PairRecord> pairs;          // verified; of record.id
  std::span<const WordId> words;
  const std::vector<uint8_t>* original = nullptr;  // what its private areas were filled in
};

// Whether it has more pixels.
bool IsLarger(const ImageRecord& record, const ImageRecord& stored);

// Whether private areas are filled in the stored photo, and none are in the larger copy, which
// would show them. Reads both photos.
Result<bool> ShowsWhatIsFilled(const Snapshot& snapshot, const ImageRecord& record,
                               const ImageRecord& stored);

// The image keeps its number, its names, its contributor, its pose and what is known about it; its
// bytes, its size, its camera, its features and its pairs are those of `better` from now on. Each
// of its points is seen by the feature that lies at the same place of the picture; a point that has
// none loses the view. The adjustment of what it is a part of is due, and where it has no pose, it
// is tried again. What the dense pass made of it is outdated, and is made anew by the next pass.
// `actor` has sent it. False, and nothing is changed, where too few of its points are found in the
// larger copy. After an error nothing is committed and the map may be half changed: the caller
// clears it. O(what is around the image).
Result<bool> TakeBetterVersion(const IngestParts& parts, const ImageRecord& stored,
                               const BetterVersion& better, const std::string& actor,
                               DatabaseState state, WriteScope scope);

}  // namespace veduta
