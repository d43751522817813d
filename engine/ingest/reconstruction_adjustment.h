// SPDX-License-Identifier: Apache-2.0
#pragma once
// The adjustment of a whole reconstruction (R18).

#include <span>

#include "engine/ingest/doubt.h"
#include "engine/ingest/mapping_context.h"

namespace veduta {

// Looks for better poses of the images by all that is mapped now (better_pose.h), and moves those
// that have one. The images must be loaded with their surroundings, all of one reconstruction.
Status ReconsiderPoses(const MappingContext& context, std::span<const ImageId> images);

// Reconsiders the poses of a reconstruction; then, twice, completes its tracks, adjusts all its
// poses and points, and filters; in between it joins tracks by all verified pairs. What its own
// evidence speaks against then loses its pose, or is cut off (doubt.h), and the rest is adjusted
// once more. Loads all of it. The frame stays (AdjustBundle). After an error the map may be half
// changed: the caller clears it.
Result<Healing> AdjustReconstruction(const MappingContext& context, ReconstructionId id);

}  // namespace veduta
