// SPDX-License-Identifier: Apache-2.0
// Goal: a lens projects as the camera model says, with a change and without one.
// Method: the same points by DistortPixel.
#include "engine/mapping/lens_projection.h"

#include <gtest/gtest.h>

#include "engine/camera/projection.h"

namespace veduta {
namespace {

TEST(LensProjection, IsThatOfTheCameraModel) {
  const CameraModel lens{1600, 1200, 1400, 1410, 790, 610, -0.12, 0.03, 805, 595};
  for (const LensChange& change :
       {LensChange(0, 0, 0), LensChange(0.05, 0, 0), LensChange(-0.03, 0.04, -0.02)}) {
    const CameraModel changed = ChangedLens(lens, change);
    for (const Eigen::Vector3d& x_cam :
         {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(-1, 0.7, 2), Eigen::Vector3d(1.1, 0.2, 3)}) {
      const Eigen::Vector2d seen = ProjectThroughLens<double>(lens, change.data(), x_cam);
      EXPECT_LT((seen - DistortPixel(changed, *PixelFromBearing(changed, x_cam))).norm(), 1e-9);
    }
  }
}

TEST(LensProjection, TheFocalLengthAloneKeepsThePicturesDistortion) {
  const CameraModel lens{1600, 1200, 1400, 1410, 790, 610, -0.12, 0.03, 805, 595};
  const CameraModel longer = ChangedLens(lens, {0.1, 0, 0});
  EXPECT_NEAR(longer.fx, 1400 * std::exp(0.1), 1e-9);
  for (const Eigen::Vector2d& place : {Eigen::Vector2d(0, 0), Eigen::Vector2d(1200, 300)})
    EXPECT_LT((DistortPixel(longer, place) - DistortPixel(lens, place)).norm(), 1e-9);
}

}  // namespace
}  // namespace veduta
