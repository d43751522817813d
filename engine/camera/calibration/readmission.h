// SPDX-License-Identifier: Apache-2.0
#pragma once
// A second chance for photos and points that an adjustment did not use: the scene is better by now.

#include <string>
#include <vector>

#include "engine/camera/calibration/observation_choice.h"
#include "engine/camera/calibration/plane_adjustment.h"

namespace veduta {

// A photo none of whose observations is used gets a pose from the points that are used, if enough
// of them agree. Photos with a reason in `never` are passed over. Then a point none of whose
// observations is used gets the place on the plane where most photos with a pose see it. Photos and
// points that cannot be placed stay as they are.
void PlaceWhatWasLeftOut(const std::vector<PlaneObservation>& observations,
                         const ObservationChoice& choice, const std::vector<std::string>& never,
                         PlaneScene* scene);

}  // namespace veduta
