// SPDX-License-Identifier: Apache-2.0
// Goal: a feature whose support touches a private area goes, also where a lens bends it there; all
//   others stay in their order.
// Method: features on a line through an area, against the distance that their scale allows.
#include "engine/photo/private_features.h"

#include <gtest/gtest.h>

#include "engine/camera/projection.h"

namespace veduta {
namespace {

Features Line(float scale_px) {
  Features features;
  for (int x = 0; x < 400; ++x) {
    Keypoint k;
    k.x_px = static_cast<float>(x);
    k.y_px = 100;
    k.scale_px = scale_px;
    features.keypoints.push_back(k);
    features.descriptors.insert(features.descriptors.end(), kDescriptorSize,
                                static_cast<uint8_t>(x));
  }
  return features;
}

TEST(PrivateFeatures, KeepTheirDistance) {
  const PixelArea area{200, 50, 20, 100};
  for (const float scale : {1.0f, 3.0f, 8.0f}) {
    Features features = Line(scale);
    DropPrivate({&area, 1}, nullptr, &features);
    ASSERT_EQ(features.descriptors.size(), features.size() * kDescriptorSize);
    size_t expected = 0;
    for (int x = 0; x < 400; ++x) {
      const double away = x < 200 ? 199.5 - x : x > 219 ? x - 219.5 : 0;
      if (away <= kSupportRadius * scale) continue;
      ASSERT_LT(expected, features.size());
      EXPECT_EQ(features.keypoints[expected].x_px, static_cast<float>(x));
      EXPECT_EQ(features.descriptor(expected)[5], static_cast<uint8_t>(x));
      ++expected;
    }
    EXPECT_EQ(features.size(), expected);
  }
}

TEST(PrivateFeatures, AreLookedForWhereTheLensHasThem) {
  CameraModel camera;
  camera.width_px = 400, camera.height_px = 200;
  camera.fx = camera.fy = 300;
  camera.cx = camera.u0 = 199.5;
  camera.cy = camera.v0 = 99.5;
  camera.k1 = -0.3;
  const PixelArea area{20, 50, 10, 100};
  Features features = Line(1);
  DropPrivate({&area, 1}, &camera, &features);
  EXPECT_LT(features.size(), 400u);
  for (const Keypoint& k : features.keypoints) {
    const Eigen::Vector2d seen = DistortPixel(camera, {k.x_px, k.y_px});
    EXPECT_FALSE(seen.x() > 20 - 5 && seen.x() < 30 + 5) << k.x_px << " is seen at " << seen.x();
  }
}

TEST(PrivateFeatures, AllStayWithoutAreas) {
  Features features = Line(5);
  DropPrivate({}, nullptr, &features);
  EXPECT_EQ(features.size(), 400u);
}

}  // namespace
}  // namespace veduta
