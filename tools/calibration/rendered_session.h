// SPDX-License-Identifier: Apache-2.0
#pragma once
// A calibration session from the sheets on: rendered photos of a floor, the markers found in them,
// and the truth.

#include <string>
#include <vector>

#include "storage/base/thread_pool.h"
#include "tools/calibration/synthetic_session.h"
#include "tools/markers/bench.h"

namespace veduta {

struct RenderedSession {
  SyntheticSession session;  // its input is what was found in the photos that are of use
  std::vector<floor::PhotoOutcome> found;  // of each photo, beside the truth
  uint32_t useless_count = 0;              // photos with too few markers
};

// Session `index` with the camera of ExperimentOptions, 1600x1200: 96 markers on 16 scattered
// sheets that are not quite flat, on one of the four floorings; photos from all around, tilted by
// up to 50 degrees, each blurred and shaken a little, with noise, vignetting and uneven light;
// JPEG 90. One photo on each thread. Deterministic in the index. keep: an existing folder that the
// photos are written to; may be empty.
RenderedSession RenderSession(uint32_t index, const std::string& keep, ThreadPool* pool);

}  // namespace veduta
