// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a new photo and a stored image see the same scene, and by which matches (R11, R12).

#include "engine/mapping/city_map.h"
#include "engine/mapping/resection.h"
#include "engine/matching/mutual_matcher.h"
#include "engine/matching/two_view.h"
#include "engine/photo/image_features.h"

namespace veduta {

struct PairOptions {
  TwoViewOptions two_view;
  // Of P3P against the candidate's points. 300 samples are enough for a confidence of 1 - 1e-4 at a
  // share of inliers of 0.31 (Fischler and Bolles 1981, samples of 3); where that finds nothing,
  // the five-point algorithm is tried.
  ResectionOptions structure = {.samples_max = 300};
  // (0, 1]. Distance to the best candidate over that to the second best, of the matches that count.
  // Chosen by hand; not measured.
  double ratio_max = 0.88;
  // >= 1. With fewer such matches the pair is given up: so many inliers are needed in the paper's
  // section 3.2.
  uint32_t distinct_count_min = 20;
  // >= 4. From so many matches with points on, P3P takes the place of the five-point algorithm.
  // Chosen by hand; not measured.
  uint32_t structure_count_min = 40;

  Status Check() const;
};

struct PairVerification {
  TwoViewOutcome outcome = TwoViewOutcome::kTooFewMatches;
  PairRecord pair;            // set when verified
  uint32_t inlier_count = 0;  // matches that agree with the best geometry, verified or not
  double match_ms = 0, verify_ms = 0;
};

// Mutual nearest neighbours. Of the candidate, as many of its strongest features take part as may
// take part of the photo's.
std::vector<DescriptorMatch> MatchImages(const ImageFeatures& photo, const ImageFeatures& candidate,
                                         const MatchOptions& options = {});

// Matches and verifies. Where `map` holds the candidate with enough points, the geometry comes from
// the photo's pose against these. Deterministic in its inputs and the seed; thread-safe for a map
// that nobody changes meanwhile.
PairVerification VerifyPair(const ImageFeatures& photo, const ImageFeatures& candidate,
                            const CityMap& map, uint64_t seed, const PairOptions& options);

}  // namespace veduta
