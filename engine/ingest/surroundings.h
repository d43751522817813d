// SPDX-License-Identifier: Apache-2.0
#pragma once
// How the map grows around a placed image and is adjusted there.

#include "engine/ingest/mapping_context.h"
#include "engine/mapping/covisible_images.h"

namespace veduta {

// Matches the image with those around it along the epipolar lines that their poses give, projects
// what they see into it, and what it sees into them. Loads what it needs.
Status GrowAround(const MappingContext& context, ImageId image);

// Adjusts the poses of the image and of those around it, `images_max` in all, and the points that
// they see, then filters these points. Everything else is held. Loads what it needs.
// kInvalidArgument when there is nothing to adjust.
Status AdjustAround(const MappingContext& context, ImageId image, size_t images_max);

}  // namespace veduta
