// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a camera is calibrated by where its photos show any place: a reconstruction of them, with
// the features where they lie in the photos as they were taken.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/camera/calibration/plane_adjustment.h"
#include "engine/engine.h"

namespace veduta {

struct LensScene {
  PlaneScene scene;
  std::vector<PlaneObservation> observations;  // in the photos as they were taken
  std::vector<uint32_t> photos;                // of the views: the numbers that are their names
};

// The largest reconstruction of a city all of whose photos one camera took, and whose names are
// numbers; of its points the `points_max` that most images see, and of each two images some, so
// that what holds its parts together is among them. Empty where nothing was founded. Errors are
// those of reading the database.
Result<LensScene> ReadLensScene(const Engine& engine, const CameraModel& camera,
                                uint32_t points_max);

// Leaves out points that too few views see, or from one side only, and views that see too few of
// the others, one round after the other. What is left is numbered anew.
void DropLoose(LensScene* scene);

// Leaves out observations that lie elsewhere than the adjusted scene has them, by far more than
// most.
void DropMisfits(const PlaneAdjustment& made, LensScene* scene);

struct AdjustedLens {
  LensScene scene;
  PlaneAdjustment made;

  // Standard deviation of the focal length over itself; means nothing where `made` is not
  // determined.
  double FocalShare() const;
};

// Adjusts poses, points and lens together (without a plane, the principal point near the photo's
// middle), leaves out what does not fit, and adjusts the rest. Nothing where less than `views_min`
// views are left. Errors as of AdjustPlane.
Result<std::optional<AdjustedLens>> AdjustLens(LensScene scene, uint32_t views_min);

}  // namespace veduta
