// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a new photo and a stored image see the same scene, and by which matches (R11, R12).

#include "engine/mapping/map.h"
#include "engine/mapping/resection.h"
#include "engine/matching/mutual_matcher.h"
#include "engine/matching/two_view.h"
#include "engine/photo/image_features.h"

namespace veduta {

struct PairOptions {
  TwoViewOptions two_view;
  ResectionOptions structure = {.samples_max = 300};  // P3P against the candidate's points
  double ratio_max = 0.88;                            // (0, 1]: of the matches that are considered
  uint32_t distinct_count_min = 20;                   // fewer such matches: the pair is hopeless
  uint32_t structure_count_min =
      40;  // matches with points from which P3P takes the place of the five-point
};

struct PairVerification {
  TwoViewOutcome outcome = TwoViewOutcome::kTooFewMatches;
  PairRecord pair;  // set when verified
  uint32_t inlier_count = 0;
  double match_ms = 0, verify_ms = 0;
};

// Mutual nearest neighbours, with as many of the candidate's strongest features as there may be of
// the photo's.
std::vector<DescriptorMatch> MatchImages(const ImageFeatures& photo, const ImageFeatures& candidate,
                                         const MatchOptions& options = {});

// Matches and verifies. `map` may hold the candidate with its points, or not. Deterministic;
// thread-safe for a map that nobody changes meanwhile.
PairVerification VerifyPair(const ImageFeatures& photo, const ImageFeatures& candidate,
                            const Map& map, uint64_t seed, const PairOptions& options);

}  // namespace veduta
