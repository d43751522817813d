// SPDX-License-Identifier: Apache-2.0
// Goal: the steps between two sweeps do each what they say.
// Method: small maps made by hand; dominant planes from two planes with noise and outliers.
#include "fusion/depth/inverse_depth_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fusion/depth/dominant_planes.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

template <typename Function>
InverseDepthMap MakeMap(uint32_t width, uint32_t height, const Function& function) {
  InverseDepthMap map{width, height, {}};
  for (uint32_t i = 0; i < width * height; ++i)
    map.w.push_back(static_cast<float>(function(i % width, i / width)));
  return map;
}

TEST(RefineBetweenPlanes, FindsTheMinimumOfTheCosts) {
  PlaneChoice choice;
  choice.plane = {1, 1, 0, 2, 1};
  choice.cost_before = {30, 50, UINT16_MAX, 20, 900};
  choice.cost = {10, 10, 10, 10, 10};
  choice.cost_after = {30, 30, 20, 30, 11};
  std::vector<SweepPlane> planes = {{0, 0, 1}, {0, 0, 2}, {0, 0, 3}, SweepPlane::Gap()};
  EXPECT_EQ(RefineBetweenPlanes(choice, 5, 1, {}, planes).w,
            (std::vector<float>{2, 2.25f, 1, 2.75f, 2.5f - 1.f / 1780}));
  planes[1].x = 10;  // slanted: at x = 1 it is 12
  EXPECT_FLOAT_EQ(RefineBetweenPlanes(choice, 5, 1, {}, planes).w[1], 12 - 0.25f * 9);
  EXPECT_FLOAT_EQ(RefineBetweenPlanes(choice, 5, 1, {7, 7, 7, 7, 7}, planes).w[2], 8);
  choice.plane[3] = 2;
  choice.cost_after[3] = 10;  // towards the gap: stays
  EXPECT_EQ(RefineBetweenPlanes(choice, 5, 1, {}, planes).w[3], 3);
}

TEST(RemoveSpeckles, TakesSmallPatchesOnly) {
  // A slope, a patch of 3 x 2 far from it, and a lone unknown pixel.
  InverseDepthMap map = MakeMap(10, 8, [](uint32_t x, uint32_t y) {
    return x >= 3 && x < 6 && y >= 2 && y < 4 ? 9.0 : 0.1 * x;
  });
  map.w[0] = kUnknown;
  InverseDepthMap small = map, large = map;
  RemoveSpeckles(0.11, 6, &small);
  RemoveSpeckles(0.11, 7, &large);
  for (size_t i = 1; i < map.w.size(); ++i) {
    EXPECT_EQ(small.w[i], map.w[i]);
    EXPECT_EQ(std::isnan(large.w[i]), map.w[i] == 9) << i;
  }
  InverseDepthMap none = map;
  RemoveSpeckles(0.05, 100, &none);  // no neighbours in x are near enough
  for (const float w : none.w) EXPECT_TRUE(std::isnan(w));
}

TEST(FillFromBackground, TakesTheFartherSide) {
  const float u = kUnknown;
  InverseDepthMap map{4, 4, {u, u, u, u, 5, u, u, 2, u, u, u, u, u, 3, u, u}};
  FillFromBackground(1, &map);
  EXPECT_EQ(map.w, (std::vector<float>{5, 2, 2, 2, 5, 2, 2, 2, 5, 2, 2, 2, 3, 3, 3, 3}));
  InverseDepthMap empty{2, 1, {u, u}};
  FillFromBackground(7, &empty);
  EXPECT_EQ(empty.w, (std::vector<float>{7, 7}));
}

TEST(SmoothBetweenEdges, KeepsSlopesAndEdges) {
  ThreadPool pool(1);
  const InverseDepthMap slope =
      MakeMap(20, 15, [](uint32_t x, uint32_t y) { return 0.5 * x + 0.25 * y; });
  const InverseDepthMap smooth = SmoothBetweenEdges(slope, 3, pool);
  for (uint32_t y = 2; y < 13; ++y) {
    for (uint32_t x = 2; x < 18; ++x) EXPECT_NEAR(smooth.w[y * 20 + x], slope.w[y * 20 + x], 1e-5);
  }
  const InverseDepthMap edge = MakeMap(20, 15, [](uint32_t x, uint32_t) { return x < 9 ? 1 : 5; });
  EXPECT_EQ(SmoothBetweenEdges(edge, 1, pool).w, edge.w);
  SeededRandom random(3);
  const InverseDepthMap noise = MakeMap(20, 15, [&](uint32_t, uint32_t) { return random.Unit(); });
  double before = 0, after = 0;
  const InverseDepthMap less = SmoothBetweenEdges(noise, 1, pool);
  for (size_t i = 0; i < noise.w.size(); ++i) {
    before += std::pow(noise.w[i] - 0.5, 2);
    after += std::pow(less.w[i] - 0.5, 2);
  }
  EXPECT_LT(after, before / 5);
}

TEST(Enlarge, RepeatsPixels) {
  const InverseDepthMap map{2, 1, {3, 4}};
  EXPECT_EQ(Enlarge(map, 5, 2).w, (std::vector<float>{3, 3, 4, 4, 4, 3, 3, 4, 4, 4}));
}

TEST(DominantPlanes, FindsGroundAndWallAmongNoise) {
  SeededRandom random(5);
  const InverseDepthMap map = MakeMap(200, 150, [&](uint32_t x, uint32_t y) {
    if (random.Below(3) == 0) return random.Unit() * 60;
    const double noise = (random.Unit() - 0.5) * 0.4;
    return (y > 70 ? 0.5 * y - 20 : 5 + 0.05 * x) + noise;
  });
  std::vector<uint8_t> confidence(map.w.size(), 1);
  const std::vector<PlaneInView> planes = FindDominantPlanes(map, confidence, 0.5, 5);
  ASSERT_EQ(planes.size(), 2u);
  EXPECT_NEAR(planes[0].y, 0.5, 0.01);
  EXPECT_NEAR(planes[0].x, 0, 0.002);
  EXPECT_NEAR(planes[0].constant, -20, 1);
  EXPECT_NEAR(planes[1].x, 0.05, 0.002);
  EXPECT_NEAR(planes[1].At(0, 0), 5, 0.2);
  EXPECT_EQ(FindDominantPlanes(map, confidence, 0.5, 1).size(), 1u);
  std::fill(confidence.begin(), confidence.end(), 0);
  EXPECT_TRUE(FindDominantPlanes(map, confidence, 0.5, 5).empty());
}

}  // namespace
}  // namespace veduta
