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
  // Of each view; empty for a view that is used. A reason once given stays.
  std::vector<std::string> why_left_out;
};

// As in CalibrationOptions, from which they are taken.
struct ChoiceOptions {
  uint32_t photo_points_min = 8;  // >= 4; a view with fewer points that fit is left out
  double photo_share_min = 0.5;   // (0, 1]; the share of a view's points that must fit

  Status Check() const;  // the first violated bound, named with its value
};

// errors: of each observation, its length over what is allowed. An error over 1, or one that is not
// finite, does not fit. Views that *choice leaves out already stay so; others may join them.
void ChooseObservations(const std::vector<PlaneObservation>& observations,
                        const std::vector<double>& errors, const ChoiceOptions& options,
                        ObservationChoice* choice);

// The observations of a scene that are used, with the views and points that they see, numbered
// anew.
struct CompactScene {
  PlaneScene scene;
  std::vector<PlaneObservation> observations;
  std::vector<uint32_t> views, points;  // which ones of the whole scene; ascending
  std::vector<uint32_t> indices;        // which ones of all observations; ascending
};
CompactScene Compact(const std::vector<PlaneObservation>& observations,
                     const ObservationChoice& choice, const PlaneScene& whole);
// Writes the camera, the poses and the points of `compact` back to the whole scene.
void Expand(const CompactScene& compact, PlaneScene* whole);

}  // namespace veduta
