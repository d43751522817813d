// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds a photo's verified neighbours and gives it a pose by them.

#include <functional>
#include <span>

#include "engine/door/submission.h"
#include "engine/ingest/ingest_options.h"
#include "engine/ingest/mapping_context.h"
#include "engine/ingest/neighbor_finder.h"
#include "engine/ingest/placement.h"

namespace veduta {

struct LocatedPhoto {
  Placement placement;
  NeighborSearch search;  // the verified pairs, to be stored whatever the verdict
  StepTimes times;        // match, verify, map and adjust
};

// Gives the photo a pose by its verified pairs, or says why it gets none. The map is as it was
// found where it gets none, or empty.
using PoseGiver =
    std::function<Result<Placement>(const ImageFeatures& photo, std::span<const PairMatches>)>;

// Seeks the photo's neighbours among `candidates`, which retrieval ranked. Where that fails,
// or where no neighbour shares much with it, the most promising candidates are searched once more
// by more features. After an error the map may be half changed: the caller clears it. Deterministic
// in its inputs and the seed, where `give_pose` is.
Result<LocatedPhoto> LocatePhoto(const MappingContext& context, const IngestOptions& options,
                                 const ImageFeatures& photo, const CameraModel& camera,
                                 std::span<const RankedImage> candidates,
                                 const PoseGiver& give_pose, uint64_t seed);

// LocatePhoto with PlacePhoto as `give_pose`, which explains `new_reconstruction`.
Result<LocatedPhoto> LocatePhoto(const MappingContext& context, const IngestOptions& options,
                                 const ImageFeatures& photo, const CameraModel& camera,
                                 std::span<const RankedImage> candidates,
                                 ReconstructionId new_reconstruction, uint64_t seed);

}  // namespace veduta
