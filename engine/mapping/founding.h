// SPDX-License-Identifier: Apache-2.0
#pragma once
// Starts a reconstruction from the best three of several views (R17).

#include <span>

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/city_map.h"
#include "engine/mapping/growth.h"
#include "engine/mapping/point_filter.h"
#include "engine/mapping/repetition.h"
#include "engine/mapping/resection.h"
#include "storage/model/pair.h"

namespace veduta {

struct FoundingOptions {
  // >= 3. Points seen in all three views; the paper's section 3.3.
  uint32_t common_points_min = 20;
  // (0, 90), degrees. Angle at which the rays of those points meet; the paper's section 3.3.
  double angle_deg_min = 2.0;
  // >= 1. First pairs that are tried, the best first. Chosen by hand; not measured.
  uint32_t pairs_tried_max = 8;
  // [0, 1]. Share of the third view's correspondences that its pose must explain. Chosen by hand;
  // not measured.
  double explained_share_min = 0.4;
  // > 0. DeviationShare (pose_deviation.h) of each of the three views. As that of poses that are
  // found later (MapperOptions::deviation_share_max).
  double deviation_share_max = 0.005;
  // > 0. DeviationShareInNetwork of each of the three views, which holds the uncertainty of the
  // other two as well. Chosen by the first 60 photos of one order of three streets (--seed 21, 32
  // and 51): of the triples that the limit above let pass, 22 were right to half a percent of the
  // depth, and none of these had more than 1 %; 20 were wrong by 2 % and more, and 17 of these had.
  double network_deviation_share_max = 0.01;
  // > 0. A plane has two relative poses. A triple is taken only where that of the other pose scores
  // at most so large a share: points that all three see over their mean squared error. Chosen by
  // two orders of streets of 150 (by points that all three see over the mean squared error of all
  // points): of 25 triples one was wrong by 19 degrees and scored a fourteenth of its twin; right
  // ones that had a twin scored 1.7 to 9 times as much as that. Two that were wrong are not noticed
  // so: one by 5 degrees scored 3 times as much, one at a twin facade had none.
  double twin_score_share_max = 0.5;
  // [0, 1]. RepeatedShare of the views: where it is more, what is founded may be folded. Between
  // the shares of repeated and of other sets that RepetitionOptions tells.
  double repeated_share_max = 0.14;
  // > 0, px. Root mean square of the errors after adjustment. Chosen by hand; not measured.
  double rms_px_max = 1.5;
  RepetitionOptions repetition;
  ResectionOptions resection;  // of the third view
  GrowthOptions growth;
  BundleOptions bundle;
  PointFilterOptions filter;

  Status Check() const;
};

enum class FoundingOutcome : uint8_t {
  kFounded,
  kNoPair,        // no pair of views with parallax
  kNoThirdView,   // no third view sees enough of the pair's points
  kTooFewPoints,  // too few points common to the three, or their angles too small
  kUndetermined,  // the points do not say where each of the three stands, or there are two ways
  kRepeated,      // the views show the same thing again and again
};

// Candidate views, which are not placed yet (id, camera, features and grid are set), and the
// verified pairs between them.
struct FoundingViews {
  std::vector<MapImage> images;   // ascending ids
  std::vector<PairRecord> pairs;  // a < b
};

// The paper's equation 6 with the 1/N of a least-squares estimate: (1/N^2) sum of 1 /
// sin^2(alpha_i) over the matches; lower is better. Infinite for a pair without parallax.
double DepthVariance(const PairRecord& pair, const MapImage& a, const MapImage& b);

// Chooses the pair of least depth variance, and to it the third view of least depth variance;
// places the pair by its five-point geometry and the third view by P3P; adjusts and filters. Where
// another relative pose of the pair (plane_twin.h) holds the three together clearly better, it is
// taken; where neither is clearly better, neither. Nothing is founded by views that show the same
// thing again and again (repetition.h).
// `required` must be among the three, for triples without it were tried before. On success `map`
// holds exactly the three placed images and their points under `reconstruction`, with the first
// pair's baseline as unit of length and the frame of the first camera; otherwise it is empty.
// Deterministic in its inputs and the seed. `memory`: RepeatedShare.
FoundingOutcome TryFounding(const FoundingViews& views, ImageId required,
                            ReconstructionId reconstruction, uint64_t seed,
                            const FoundingOptions& options, CityMap* map,
                            RepetitionMemory* memory = nullptr);

}  // namespace veduta
