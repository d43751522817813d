// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which observations an adjustment uses: those that fit, of photos most of whose points fit, of
// points seen twice.

#include <cstdint>
#include <string>
#include <vector>

#include "engine/camera/calibration/plane_adjustment.h"

namespace veduta {

// Of all observations of all views and points; an index here is an index there.
struct ObservationChoice {
  std::vector<bool> is_used;  // of each observation
  std::vector<std::string>
      why_left_out;  // of each view; empty for those used. Stays once it is said
};

struct ChoiceOptions {
  uint32_t photo_points_min = 8;
  double photo_share_min = 0.5;
};

// errors: of each observation, length over limit; what is over 1 or not finite does not fit. Views
// already left out in *choice stay so; others may join them.
void ChooseObservations(const std::vector<PlaneObservation>& observations,
                        const std::vector<double>& errors, const ChoiceOptions& options,
                        ObservationChoice* choice);

// The used observations of a scene with the views and points that they see, numbered anew.
struct CompactScene {
  PlaneScene scene;
  std::vector<PlaneObservation> observations;
  std::vector<uint32_t> views, points,
      indices;  // of the whole scene, of all observations; ascending
};
CompactScene Compact(const std::vector<PlaneObservation>& observations,
                     const ObservationChoice& choice, const PlaneScene& whole);
void Expand(const CompactScene& compact, PlaneScene* whole);

}  // namespace veduta
