// SPDX-License-Identifier: Apache-2.0
#pragma once
// What cameras are calibrated by where their photos show any place: a reconstruction of them, with
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
  std::vector<uint32_t> cameras = {0};         // of the cameras: their numbers in the city, from 0
};

// The largest reconstruction of a city whose photos have numbers for names, with the city's cameras
// in the order in which they were added; of its points the `points_max` that most images see, and
// of each two images some, so that what holds its parts together is among them. Empty where nothing
// was founded. Errors are those of reading the database.
Result<LensScene> ReadLensScene(const Engine& engine, std::vector<CameraModel> cameras,
                                uint32_t points_max);

// Leaves out points that too few views see, or from one side only, views that see too few of the
// others, one round after the other, and cameras that took none. What is left is numbered anew.
void DropLoose(LensScene* scene);

// Leaves out observations that lie elsewhere than the adjusted scene has them, by far more than
// most.
void DropMisfits(const PlaneAdjustment& made, LensScene* scene);

struct AdjustedLens {
  LensScene scene;
  PlaneAdjustment made;

  // Standard deviation of the focal length over itself; means nothing where `made` is not
  // determined.
  double FocalShare(size_t camera = 0) const;
};

// Adjusts poses, points and lenses together (without a plane), leaves out what does not fit, and
// adjusts the rest. The principal point lies near the photo's middle, unless the photos want it
// clearly elsewhere, as where they were cropped. Nothing where less than `views_min` views are
// left. Errors as of AdjustPlane.
Result<std::optional<AdjustedLens>> AdjustLens(LensScene scene, uint32_t views_min);

// Of the cameras of an adjusted scene those that hardly took all of their views, ascending: with a
// camera of its own, many a view wants another focal length, or most of them want one that is not
// the common one. Tourists' photos of one size fit one camera by chance, as far as the others are
// left out. Errors as of AdjustPlane.
Result<std::vector<uint32_t>> ListManyLensed(const LensScene& adjusted, uint32_t views_min);

}  // namespace veduta
