// SPDX-License-Identifier: Apache-2.0
#pragma once
// Starts a reconstruction from the best triple of views (R17).

#include <span>

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/growth.h"
#include "engine/mapping/map.h"
#include "engine/mapping/point_filter.h"
#include "engine/mapping/resection.h"
#include "storage/model/pair.h"

namespace veduta {

struct FoundingOptions {
  uint32_t common_points_min = 20;  // >= 3: seen in all three views; the paper's section 3.3
  double angle_deg_min = 2.0;       // (0, 90): of those points; likewise
  uint32_t pairs_tried_max = 8;     // >= 1: best first
  double explained_share_min =
      0.4;  // [0, 1]: of the third view's correspondences that its pose must explain
  double rms_px_max = 1.5;  // > 0: after adjustment
  ResectionOptions resection;
  GrowthOptions growth;
  BundleOptions bundle;
  PointFilterOptions filter;
};

enum class FoundingOutcome : uint8_t {
  kFounded,
  kNoPair,        // no pair of views with parallax
  kNoThirdView,   // no third view sees enough of the pair's points
  kTooFewPoints,  // too few points common to the three, or their angles too small
};

// Candidate views, not placed yet: id, camera, features and grid set; and the verified pairs
// between them.
struct FoundingViews {
  std::vector<MapImage> images;   // ascending ids
  std::vector<PairRecord> pairs;  // a < b
};

// Eq 6 with the 1/N of a least-squares estimate: (1/N^2) sum of 1 / sin^2(alpha_i) over the
// matches; lower is better. Infinite for a pair without parallax.
double DepthVariance(const PairRecord& pair, const MapImage& a, const MapImage& b);

// The pair of least depth variance, then the third view likewise; five-point, P3P, adjustment,
// filter. `required` must be among the three (the others were tried before). On success `map` holds
// exactly the three placed images and their points under `reconstruction`, with the first pair's
// baseline as unit of length; the frame is that of the first camera. Deterministic in its inputs
// and seed.
FoundingOutcome Found(const FoundingViews& views, ImageId required, ReconstructionId reconstruction,
                      uint64_t seed, const FoundingOptions& options, Map* map);

}  // namespace veduta
