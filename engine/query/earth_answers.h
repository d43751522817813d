// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the city knows of its place on the earth, read from one snapshot.

#include <optional>

#include "engine/door/answers.h"
#include "engine/door/earth.h"
#include "storage/database.h"

namespace veduta {

// Where a camera of this reconstruction is on the earth; nothing where the reconstruction has no
// place.
Result<std::optional<EarthPose>> EarthPoseIn(const Snapshot& snapshot,
                                             ReconstructionId reconstruction,
                                             const Rigid3& cam_from_world);
// The same of a pose that was told, with how sure that is, where it is known.
Result<std::optional<EarthPose>> EarthPoseIn(const Snapshot& snapshot,
                                             ReconstructionId reconstruction,
                                             const PlainPose& cam_from_world,
                                             const std::optional<PoseUncertainty>& uncertainty);

// All living reconstructions and all surveyed points. GroundPointAnswer::error_px is above 0 where
// two photos of one reconstruction show the point from different sides, be the place of that known
// or not, and 0 elsewhere. O(reconstructions + sightings).
Result<GeoreferenceAnswer> GeoreferenceOf(const Snapshot& snapshot);

}  // namespace veduta
