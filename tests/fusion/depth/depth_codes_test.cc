// SPDX-License-Identifier: Apache-2.0
// Goal: stored depth maps lose less than stereo can tell, and read back the same each time; the
//   range that is swept holds the scene.
// Method: random depths over wide and narrow ranges; ranges from made-up depths with outliers.
#include "fusion/depth/depth_codes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

TEST(DepthCodes, WithinHalfAStepOfInverseDepth) {
  for (const DepthRange range : {DepthRange{0.1, 1000}, DepthRange{5, 5.5}}) {
    SeededRandom random(3);
    DepthMap map{64, 32, {}, {}};
    for (size_t i = 0; i < 64 * 32; ++i) {
      const double inverse = 1 / range.far + random.Unit() * (1 / range.near - 1 / range.far);
      map.depth.push_back(i % 7 == 0 ? 0.0f : static_cast<float>(1 / inverse));
      map.confidence.push_back(i % 7 == 0 ? 0 : 200);
    }
    const DepthPixels pixels = EncodeDepth(map, range);
    const auto read = DecodeDepth(pixels, 64, 32, range);
    ASSERT_TRUE(read.ok());
    const double step = (1 / range.near - 1 / range.far) / 65534;
    for (size_t i = 0; i < map.depth.size(); ++i) {
      if (map.depth[i] == 0) {
        EXPECT_EQ(read->depth[i], 0);
      } else {
        EXPECT_NEAR(1 / read->depth[i], 1 / map.depth[i], 0.5 * step + 2e-7 / map.depth[i]);
      }
    }
    EXPECT_EQ(read->confidence, map.confidence);
    EXPECT_EQ(EncodeDepth(*read, range).codes, pixels.codes)
        << "reading and writing changes nothing";
  }
}

TEST(DepthCodes, OutOfRangeAndWrongSize) {
  const DepthRange range{1, 10};
  const DepthPixels pixels = EncodeDepth({3, 1, {0.5f, 20, 5}, {1, 1, 1}}, range);
  EXPECT_EQ(pixels.codes[0], 65535);
  EXPECT_EQ(pixels.codes[1], 1);
  EXPECT_EQ(DecodeDepth(pixels, 2, 1, range).status().code(), StatusCode::kCorruption);
}

TEST(DepthRange, HoldsTheSceneAndNotItsOutliers) {
  std::vector<double> depths;
  for (int i = 0; i < 1000; ++i) depths.push_back(5 + i * 0.01);
  depths.push_back(1e9);
  depths.push_back(0.001);
  depths.push_back(-3);
  const auto range = DepthRangeOf(depths, 0.1);
  ASSERT_TRUE(range.ok());
  EXPECT_LT(range->near, 5);
  EXPECT_GT(range->near, 4);
  EXPECT_GT(range->far, 15);
  EXPECT_LT(range->far, 25);
}

TEST(DepthRange, PlanesHorizonsAndTooFewPoints) {
  const auto plane = DepthRangeOf(std::vector<double>(20, 7.0), 0.25);
  ASSERT_TRUE(plane.ok());
  EXPECT_LT(plane->near, 6.9);
  EXPECT_GT(plane->far, 7.1);
  std::vector<double> deep = {1, 1, 1, 1, 1, 1, 1, 1, 1000, 1000, 1000};
  const auto horizon = DepthRangeOf(deep, 0.25);
  ASSERT_TRUE(horizon.ok());
  EXPECT_TRUE(std::isfinite(horizon->far));
  EXPECT_GT(horizon->far, 1000);
  EXPECT_EQ(DepthRangeOf(std::vector<double>(7, 1.0), 0.25).status().code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(DepthRangeOf(std::vector<double>(20, 1.0), -1).status().code(),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
