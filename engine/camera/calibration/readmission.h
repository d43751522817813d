// SPDX-License-Identifier: Apache-2.0
#pragma once
// A second chance, by the scene as it has become, for photos and points that an adjustment did not
// use.

#include <string>
#include <vector>

#include "engine/camera/calibration/observation_choice.h"
#include "engine/camera/calibration/plane_adjustment.h"

namespace veduta {

// Photos without a used observation get a pose from the points that are used, where enough of them
// agree; those named in `never` (not empty) are passed over. Then points without a used observation
// get the place on the plane where most photos with a pose see them. What cannot be placed keeps
// what it had.
void PlaceWhatWasLeftOut(const std::vector<PlaneObservation>& observations,
                         const ObservationChoice& choice, const std::vector<std::string>& never,
                         PlaneScene* scene);

}  // namespace veduta
