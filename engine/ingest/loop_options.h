// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers by which seams that are not believed by themselves are believed as parts of a loop.

#include <cstdint>

#include "storage/base/status.h"

namespace veduta {

struct LoopOptions {
  // >= 1. Matches of a verified pair from which on a seam is remembered though nothing says by
  // which similarity. Chosen by hand; not measured.
  uint32_t matches_min = 100;
  // >= 1, and > 0. What a similarity by views needs, at least, where only a loop may confirm it:
  // sightings besides those of the placed camera, and the deviation of the scale's logarithm. Seams
  // at the corners of three loops had 1 to 800 and 0.0015 to 0.027; their scales were off by 0.1 to
  // 1.7 %.
  uint32_t other_sightings_min = 1;
  double log_scale_deviation_max = 0.05;
  // >= 0, degrees, and >= 0. How far each part may be bent between its two seams: standard
  // deviations of rotation and of the scale's logarithm. Streets of 300 photos, some 250 m long,
  // were off by 25 to 116 mm in the mean and by 0.18 to 0.43 m at most. Chosen by hand.
  double bend_deg = 0.1;
  double bend_log_scale = 0.002;
  // (0, 1], and (0, 180), degrees. What the rest of the loop may leave open where it closes, of how
  // far the cameras there see, and of their rotation. Chosen by hand; not measured.
  double position_share_max = 0.15;
  double rotation_deg_max = 2.0;
  // > 0. By so many standard deviations (Mahalanobis; 99 % of seven degrees of freedom) what is
  // seen where the loop closes may differ from what the rest of it says.
  double distance_max = 4.3;
  // >= 1. Images that share so many points see one place: what both stand for is one witness.
  // Chosen by hand; not measured.
  uint32_t shared_points_min = 10;

  Status Check() const;
};

}  // namespace veduta
