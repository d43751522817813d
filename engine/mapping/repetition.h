// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether views show the same thing again and again, as a front whose windows are all alike does.
// Matches agree there with a wrong relative pose as well as with the right one, and views that all
// agree may still lie folded upon each other (Roberts et al., "Structure from motion for scenes
// with large duplicate structures", CVPR 2011, shows such models). What tells is how much of what
// two views have in common fits elsewhere in the same picture, too.

#include <cstdint>
#include <optional>
#include <span>

#include "engine/mapping/city_map.h"
#include "storage/base/lru_cache.h"
#include "storage/base/status.h"
#include "storage/model/pair.h"

namespace veduta {

struct RepetitionOptions {
  // [1, 65535]. So many of the strongest features of each view are compared. As many as are matched
  // when photos are.
  uint32_t feature_count_max = 1500;
  // >= 1. Features of the other view that may be what a feature shows, the nearest descriptors.
  uint32_t alike_count_max = 5;
  // > 0, squared byte distance (root-SIFT has a norm of about 512): what is farther is not alike.
  uint32_t distance_squared_max = 60'000;
  // >= 1. One is a rival up to so many times the squared distance of the one that agrees.
  double rival_distance_factor = 4;
  // > 0, px. A rival lies farther from the place that the pair's plane gives than this.
  double apart_px = 20;
  // > 0, px. What the plane, or that of the rivals, explains.
  double error_px_max = 4;
  // [1, 1000000]. Samples of four rivals each.
  uint32_t samples = 1000;
  // >= 1. Pairs that are asked, those with most matches. All pairs of twelve views.
  uint32_t pair_count_max = 66;

  // All by hand, but for rival_distance_factor and pair_count_max: 4 tells a street of repeated
  // windows (--seed 401: shares of 0.18 to 0.31) better from castle-P19, fountain-P11, lund, museum
  // and an ordinary street (up to 0.12) than 2.25 does, and 66 pairs better than 24. A loop with
  // repeated windows (--seed 404) has 0.03 to 0.31: a quarter of it is not told.
  Status Check() const;
};

// How many features of a pair of views agree upon a plane, and how many of them another homography
// puts elsewhere.
struct Repetition {
  size_t agreeing = 0, rivalled = 0;
};
// Of pairs, by what they match. Views that found nothing are asked anew with each photo that comes
// to them, and all but one of them are the same.
using RepetitionMemory = LruCache<uint64_t, std::optional<Repetition>>;

// Of the features by which pairs of views agree upon a plane, over all pairs: the share that
// another homography, of descriptors nearly as alike, puts elsewhere in the same picture. In
// [0, 1]; 0 where no feature agrees. `images` hold both images of each pair; their poses are of no
// account. What is known of a pair is taken from `memory`, or remembered there, if that is given: a
// memory is for one set of options. Deterministic in its inputs; thread-safe; about 11 ms for each
// pair that is not known.
double RepeatedShare(std::span<const MapImage> images, std::span<const PairRecord> pairs,
                     const RepetitionOptions& options, RepetitionMemory* memory = nullptr);

}  // namespace veduta
