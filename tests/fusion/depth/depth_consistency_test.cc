// SPDX-License-Identifier: Apache-2.0
// Goal: depth that neighbours confirm stays, depth that they contradict or do not know goes.
// Method: exact depth maps of a wall seen from three places, then with patches of wrong depth.
#include "fusion/depth/depth_consistency.h"

#include <gtest/gtest.h>

#include <cmath>

namespace veduta {
namespace {

constexpr uint32_t kWidth = 80, kHeight = 60;
constexpr double kWall = 5;

ViewGeometry At(double center_x) {
  ViewGeometry view;
  view.width_px = kWidth;
  view.height_px = kHeight;
  view.camera.fx = view.camera.fy = 70;
  view.camera.cx = 39.5;
  view.camera.cy = 29.5;
  view.cam_from_world.translation.x() = -center_x;
  return view;
}

DepthMap Wall(double depth = kWall) {
  return {kWidth, kHeight, std::vector<float>(kWidth * kHeight, static_cast<float>(depth)),
          std::vector<uint8_t>(kWidth * kHeight, 100)};
}

void Paint(double depth, uint32_t x_begin, uint32_t x_end, DepthMap* map) {
  for (uint32_t y = 20; y < 40; ++y) {
    for (uint32_t x = x_begin; x < x_end; ++x)
      map->depth[y * kWidth + x] = static_cast<float>(depth);
  }
}

DepthMap Check(const DepthMap& key, const DepthMap& left, const DepthMap& right,
               ConsistencyOptions options = {}, size_t threads = 1) {
  ThreadPool pool(threads);
  const NeighborDepth neighbors[] = {{At(-0.5), &left}, {At(0.5), &right}};
  return CheckConsistency(key, At(0), neighbors, options, pool).value();
}

TEST(CheckConsistency, WhatAgreesStays) {
  ConsistencyOptions both;
  both.agreement_count_min = 2;
  const DepthMap one = Check(Wall(), Wall(), Wall()), two = Check(Wall(), Wall(), Wall(), both);
  // The wall moves by 7 px in a neighbour: columns at the borders are seen by one of them only.
  for (uint32_t x = 0; x < kWidth; ++x) {
    const size_t pixel = 30 * kWidth + x;
    const bool in_both = x >= 7 && x + 7 < kWidth;
    EXPECT_EQ(one.depth[pixel], 5) << x;
    EXPECT_EQ(two.depth[pixel], in_both ? 5 : 0) << x;
    EXPECT_GT(one.confidence[pixel], in_both ? 200 : 100) << x;
    EXPECT_LT(one.confidence[pixel], in_both ? 255 : 200) << x;
  }
}

TEST(CheckConsistency, WrongDepthGoes) {
  for (const double wrong : {3.0, 4.8, 5.2, 9.0}) {
    DepthMap key = Wall();
    Paint(wrong, 30, 50, &key);
    const DepthMap map = Check(key, Wall(), Wall());
    for (uint32_t x = 15; x < 65; ++x) {
      const size_t pixel = 30 * kWidth + x;
      EXPECT_EQ(map.depth[pixel], x >= 30 && x < 50 ? 0 : 5) << wrong << " " << x;
      EXPECT_EQ(map.confidence[pixel] == 0, map.depth[pixel] == 0);
    }
  }
}

// One neighbour repeats the mistake, the other sees through it.
TEST(CheckConsistency, AContradictionOutweighsNothingButItsLike) {
  DepthMap key = Wall(), left = Wall();
  Paint(3.5, 30, 50, &key);
  Paint(3.5, 40, 60, &left);  // 70 * 0.5 / 3.5 = 10 px to the right
  const DepthMap once = Check(key, left, Wall());
  EXPECT_EQ(once.depth[30 * kWidth + 40], 3.5f);  // one for, one against
  ThreadPool pool(0);
  const DepthMap wall = Wall();
  const NeighborDepth three[] = {{At(-0.5), &left}, {At(0.5), &wall}, {At(0.25), &wall}};
  EXPECT_EQ(CheckConsistency(key, At(0), three, {}, pool)->depth[30 * kWidth + 40], 0);
}

// What a neighbour does not see because something stands before it, it does not contradict.
TEST(CheckConsistency, AnOccludedNeighbourSaysNothing) {
  DepthMap left = Wall();
  Paint(2, 0, kWidth, &left);
  const DepthMap map = Check(Wall(), left, Wall());
  for (uint32_t x = 10; x < 70; ++x) EXPECT_EQ(map.depth[30 * kWidth + x], 5);
}

TEST(CheckConsistency, ThreadsDoNotMatter) {
  DepthMap key = Wall();
  Paint(4.97, 20, 60, &key);
  const DepthMap a = Check(key, Wall(), Wall(4.98), {}, 0),
                 b = Check(key, Wall(), Wall(4.98), {}, 3);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.confidence, b.confidence);
}

TEST(CheckConsistency, RefusesBadInput) {
  ThreadPool pool(0);
  const DepthMap wall = Wall();
  DepthMap cut = Wall();
  cut.depth.pop_back();
  const auto status = [&](const DepthMap& key, const DepthMap* neighbor,
                          const ConsistencyOptions& options) {
    const NeighborDepth one{At(1), neighbor};
    return CheckConsistency(key, At(0), {&one, 1}, options, pool).status();
  };
  EXPECT_NE(status(cut, &wall, {}).message().find("the key view"), std::string::npos);
  EXPECT_NE(status(wall, &cut, {}).message().find("neighbour 0"), std::string::npos);
  EXPECT_NE(status(wall, nullptr, {}).message().find("no map"), std::string::npos);
  ConsistencyOptions options;
  options.depth_error_max = 1;
  EXPECT_EQ(status(wall, &wall, options).code(), StatusCode::kInvalidArgument);
  options = {};
  options.pixel_error_max = 0;
  EXPECT_EQ(status(wall, &wall, options).code(), StatusCode::kInvalidArgument);
  options = {};
  options.agreement_count_min = 0;
  EXPECT_EQ(status(wall, &wall, options).code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
