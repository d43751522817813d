// SPDX-License-Identifier: Apache-2.0
#pragma once
// A reconstruction, and the poses of the images in it.

#include <cstdint>

#include "storage/base/ids.h"
#include "storage/base/transform.h"
#include "storage/model/earth.h"

namespace veduta {

struct ReconstructionRecord {
  ReconstructionId id;
  ReconstructionId merged_into;  // valid once it has been merged away
  Sim3 merged_from_this;         // merged_into's frame from this one's
  uint32_t image_count = 0;
  uint64_t point_count = 0;
  uint64_t observation_count = 0;
  double reprojection_error_px_sum = 0;  // over observations
  uint64_t geometry_version = 0;         // grows whenever a pose or point of it moves
  uint32_t points_generation = 0;        // which generation of point blocks is current
  uint32_t images_at_adjustment = 0;     // image_count when all of it was last adjusted
  bool is_dissolved = false;             // all its images have lost their poses
  Georeference georeference;

  bool is_living() const { return !merged_into.valid() && !is_dissolved; }
};

struct PoseRecord {
  ImageId image;
  ReconstructionId reconstruction;
  Rigid3 cam_from_world;
};

}  // namespace veduta
