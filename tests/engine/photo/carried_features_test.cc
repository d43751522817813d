// SPDX-License-Identifier: Apache-2.0
// Goal: features lie where the refined lens has them, whatever it was refined from; those of a lens
//   that was not refined stay, to the last bit.
// Method: places in a photo are straightened by a lens, and carried over to another one.
#include "engine/photo/carried_features.h"

#include <gtest/gtest.h>

#include "engine/camera/projection.h"

namespace veduta {
namespace {

CameraModel Wide() {
  return {1600, 1200, 1400, 1400, 790, 610, -0.12, 0.03, 800, 600};
}

Features StraightenedBy(const CameraModel& model) {
  Features features;
  for (int y = 0; y < 1200; y += 150) {
    for (int x = 0; x < 1600; x += 150) {
      const auto place = UndistortPixel(model, {x, y});
      Keypoint k;
      k.x_px = static_cast<float>(place->x()), k.y_px = static_cast<float>(place->y());
      features.keypoints.push_back(k);
    }
  }
  return features;
}

TEST(CarriedFeatures, LieWhereTheRefinedLensHasThem) {
  CameraRecord camera;
  camera.model = camera.refined_from.emplace(Wide());
  camera.model.fx = 1452, camera.model.fy = 1450;
  camera.model.k1 = -0.09, camera.model.k2 = 0.01;
  const auto extracted = std::make_shared<const Features>(StraightenedBy(*camera.refined_from));
  const auto carried = Carried(camera, extracted);
  const Features wanted = StraightenedBy(camera.model);
  double moved_px = 0;
  for (size_t i = 0; i < wanted.keypoints.size(); ++i) {
    EXPECT_NEAR(carried->keypoints[i].x_px, wanted.keypoints[i].x_px, 1e-3);
    EXPECT_NEAR(carried->keypoints[i].y_px, wanted.keypoints[i].y_px, 1e-3);
    moved_px = std::max<double>(moved_px,
                                std::abs(wanted.keypoints[i].x_px - extracted->keypoints[i].x_px));
  }
  EXPECT_GT(moved_px, 5);
}

TEST(CarriedFeatures, AreThoseThatWereExtractedWhereNothingWasRefined) {
  CameraRecord camera;
  camera.model = Wide();
  const auto extracted = std::make_shared<const Features>(StraightenedBy(camera.model));
  EXPECT_EQ(Carried(camera, extracted), extracted);
  // The focal length alone moves nothing where k1 and k2 go with it.
  camera.refined_from = camera.model;
  camera.model.fx *= 1.1, camera.model.fy *= 1.1;
  camera.model.k1 *= 1.1 * 1.1, camera.model.k2 *= 1.1 * 1.1 * 1.1 * 1.1;
  const auto carried = Carried(camera, extracted);
  for (size_t i = 0; i < extracted->keypoints.size(); ++i)
    EXPECT_NEAR(carried->keypoints[i].x_px, extracted->keypoints[i].x_px, 1e-3);
  // A model that is damaged carries nothing anywhere.
  camera.model.k1 = 1e9;
  EXPECT_EQ(Carried(camera, extracted)->keypoints, extracted->keypoints);
}

}  // namespace
}  // namespace veduta
