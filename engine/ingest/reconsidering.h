// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds better poses for placed images, by all that has been mapped since they were placed.

#include <vector>

#include "engine/ingest/mapping_context.h"

namespace veduta {

// A part of a reconstruction, with what is around it.
struct Region {
  std::vector<ImageId> images;  // what is adjusted; ascending
  // These, and all that see points which they see or are home to; ascending. Loaded with their
  // neighbourhoods.
  std::vector<ImageId> known;
};

// Looks for groups of the region's images that belong elsewhere as one body (better_body.h), and
// carries them there, unless their pictures or those there speak against it: the largest ones
// first, and none that overlaps with one that was carried.
Status ReconsiderBodies(const MappingContext& context, const Region& region);

// Looks for better poses of the region's images, one by one (better_pose.h), and moves those that
// have one.
Status ReconsiderPoses(const MappingContext& context, const Region& region);

}  // namespace veduta
