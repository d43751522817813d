// SPDX-License-Identifier: Apache-2.0
// Goal: features of a picture are found in a copy of another size where they lie at the same place
//   and look alike; each once; never by place or by looks alone.
// Method: made features, copied, moved and mixed.
#include "engine/ingest/counterparts.h"

#include <gtest/gtest.h>

#include "storage/base/content_hash.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

CameraModel Camera(uint32_t width_px, uint32_t height_px) {
  CameraModel camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx = camera.fy = width_px;
  camera.cx = camera.u0 = (width_px - 1) / 2.0;
  camera.cy = camera.v0 = (height_px - 1) / 2.0;
  return camera;
}

constexpr FeatureIndex kCount = 200;

Features MadeFeatures() {
  SeededRandom random(3);
  Features features;
  for (FeatureIndex i = 0; i < kCount; ++i) {
    Keypoint keypoint;
    keypoint.x_px = static_cast<float>(400 * random.Unit());
    keypoint.y_px = static_cast<float>(300 * random.Unit());
    features.keypoints.push_back(keypoint);
  }
  features.descriptors = SampleBytes(4, kCount * kDescriptorSize);
  return features;
}

// The same in a copy of twice the size, the last feature first.
Features DoubledFeatures(const Features& features) {
  Features doubled;
  for (FeatureIndex i = kCount; i-- > 0;) {
    Keypoint keypoint = features.keypoints[i];
    keypoint.x_px = 2 * keypoint.x_px + 0.5f;
    keypoint.y_px = 2 * keypoint.y_px + 0.5f;
    doubled.keypoints.push_back(keypoint);
    doubled.descriptors.insert(doubled.descriptors.end(), features.descriptor(i),
                               features.descriptor(i) + kDescriptorSize);
  }
  return doubled;
}

TEST(FindCounterparts, FindsEachFeatureInACopyOfAnotherSize) {
  const CameraModel small = Camera(400, 300), large = Camera(800, 600);
  const Features features = MadeFeatures(), doubled = DoubledFeatures(features);
  const auto found = FindCounterparts({small, features}, {large, doubled});
  ASSERT_EQ(found.size(), kCount);
  for (FeatureIndex i = 0; i < kCount; ++i) EXPECT_EQ(found[i], (FeatureMatch{i, kCount - 1 - i}));
}

TEST(FindCounterparts, NeitherPlaceNorLooksAloneAreEnough) {
  const CameraModel small = Camera(400, 300), large = Camera(800, 600);
  const Features features = MadeFeatures();
  Features doubled = DoubledFeatures(features);
  doubled.keypoints[kCount - 1 - 10].x_px += 4;  // 2 px of the smaller one
  const size_t other = (kCount - 1 - 20) * size_t{kDescriptorSize};
  std::fill_n(doubled.descriptors.begin() + static_cast<ptrdiff_t>(other), kDescriptorSize, 0);
  const auto found = FindCounterparts({small, features}, {large, doubled});
  EXPECT_EQ(found.size(), kCount - 2);
  for (const FeatureMatch& match : found) EXPECT_TRUE(match.a != 10 && match.a != 20);
}

TEST(FindCounterparts, OfSeveralAtOnePlaceEachHasTheOneThatLooksLikeIt) {
  const CameraModel camera = Camera(400, 300);
  Features features = MadeFeatures();
  features.keypoints[1] = features.keypoints[0];
  const auto found = FindCounterparts({camera, features}, {camera, features});
  ASSERT_EQ(found.size(), kCount);
  for (FeatureIndex i = 0; i < kCount; ++i) EXPECT_EQ(found[i], (FeatureMatch{i, i}));
}

TEST(PlaceInPicture, IsThatOfTheDistortedPicture) {
  CameraModel camera = Camera(400, 300);
  Keypoint corner;
  corner.x_px = 399.5f;
  corner.y_px = 299.5f;
  const Features none;
  EXPECT_EQ(PlaceInPicture({camera, none}, corner), Eigen::Vector2d(1, 1));
  // What the camera has at the lower right is at the lower left of a photo whose first row is at
  // the right.
  EXPECT_EQ(PlaceInPicture({camera, none, 6}, corner), Eigen::Vector2d(0, 1));
  camera.k1 = -0.1;
  EXPECT_LT(PlaceInPicture({camera, none}, corner).x(), 0.99);
}

}  // namespace
}  // namespace veduta
