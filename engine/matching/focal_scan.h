// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which focal length photos of one unknown camera agree with: only about the right one makes the
// rays of a pair's matches meet.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "engine/matching/two_view.h"
#include "storage/base/thread_pool.h"

namespace veduta {

struct FocalScanOptions {
  // > 0. The shortest and the longest focal length that is tried, over the longer side of the
  // photo: 110 and 14 degrees of view.
  double share_min = 0.35, share_max = 4;
  // >= 2. Focal lengths that are tried, evenly in the logarithm: each is then within 5 % of one.
  // Chosen by hand.
  uint32_t count = 25;
  // What counts as an inlier. Stricter than for a known camera: what is right to 5 % of the focal
  // length still explains most matches. Chosen by hand.
  TwoViewOptions two_view = {.error_px_max = 1.0, .samples_max = 300};

  Status Check() const;  // the first violated bound, named with its value
};

// Matches of two photos, px from the middle of each, the most distinctive first.
struct CenteredMatches {
  std::vector<Eigen::Vector2d> a, b;
};

// Focal lengths in px, the one first whose two-view geometries explain the matches of all pairs
// best.
// Those that explain no pair are left out. Deterministic, whatever the number of threads.
// O(focal lengths * pairs * samples * matches).
std::vector<double> RankFocalLengths(std::span<const CenteredMatches> pairs, double side_px,
                                     const FocalScanOptions& options, ThreadPool* pool);

}  // namespace veduta
