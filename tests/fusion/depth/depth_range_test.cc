// SPDX-License-Identifier: Apache-2.0
// Goal: the range of depths that is swept holds nearly all points and some room beside them.
// Method: depths of known percentiles; the margin in inverse depth computed by hand.
#include "fusion/depth/depth_range.h"

#include <gtest/gtest.h>

#include <limits>

namespace veduta {
namespace {

TEST(DepthRange, LeavesOutOnePercentOnEitherSideAndWidens) {
  std::vector<double> depths;
  for (int i = 0; i < 200; ++i) depths.push_back(2 + 0.01 * i);  // 2 to 3.99
  const auto bare = DepthRangeOf(depths, 0);
  ASSERT_TRUE(bare.ok());
  EXPECT_DOUBLE_EQ(bare->near, 2.02);
  EXPECT_DOUBLE_EQ(bare->far, 3.97);
  const auto wide = DepthRangeOf(depths, 0.25);
  ASSERT_TRUE(wide.ok());
  const double widening = 0.25 * (1 / 2.02 - 1 / 3.97);
  EXPECT_NEAR(1 / wide->near, 1 / 2.02 + widening, 1e-12);
  EXPECT_NEAR(1 / wide->far, 1 / 3.97 - widening, 1e-12);
}

TEST(DepthRange, FarIsBounded) {
  const auto range = DepthRangeOf({1, 1, 1, 1, 5, 5, 5, 5}, 10);
  ASSERT_TRUE(range.ok());
  EXPECT_NEAR(range->far, 500, 1e-9) << "100 times the farthest";
  const auto plane = DepthRangeOf(std::vector<double>(20, 7.0), 0);
  ASSERT_TRUE(plane.ok());
  EXPECT_LT(plane->near, 7);
  EXPECT_GT(plane->far, 7) << "points on one plane leave something to sweep";
}

TEST(DepthRange, RefusesTooFewAndBadMargins) {
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(DepthRangeOf({1, 1, 1, 1, 1, 1, 1, -1, 0, infinite}, 0).status().code(),
            StatusCode::kInvalidArgument)
      << "seven that count";
  EXPECT_TRUE(DepthRangeOf({1, 1, 1, 1, 1, 1, 1, 1, -1}, 0).ok());
  EXPECT_FALSE(DepthRangeOf(std::vector<double>(20, 7.0), -0.1).ok());
  EXPECT_FALSE(DepthRangeOf(std::vector<double>(20, 7.0), 10.5).ok());
}

}  // namespace
}  // namespace veduta
