// SPDX-License-Identifier: Apache-2.0
// Goal: the grid finds exactly the keypoints near a point or a line, whatever their spread.
// Method: random keypoints (spread, crowded, far apart, on the edge, not finite) against a loop
//   over all of them.
#include "engine/matching/feature_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Features RandomKeypoints(uint32_t count, double width, double height, uint64_t seed) {
  SeededRandom random(seed);
  Features features;
  features.keypoints.resize(count);
  for (Keypoint& keypoint : features.keypoints) {
    // Every fourth on a whole pixel, so that some lie on the borders of cells and of bands.
    const bool whole = random.Below(4) == 0;
    const double x = random.Unit() * width;
    const double y = random.Unit() * height;
    keypoint.x_px = static_cast<float>(whole ? std::floor(x) : x);
    keypoint.y_px = static_cast<float>(whole ? std::floor(y) : y);
    keypoint.contrast_sign = static_cast<int8_t>(static_cast<int>(random.Below(3)) - 1);
  }
  return features;
}

std::vector<FeatureIndex> LoopNearPoint(const Features& features, int contrast, double x, double y,
                                        double radius) {
  std::vector<FeatureIndex> found;
  for (size_t i = 0; i < features.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    if (ContrastClassOf(k.contrast_sign) != contrast) continue;
    if ((k.x_px - x) * (k.x_px - x) + (k.y_px - y) * (k.y_px - y) <= radius * radius) {
      found.push_back(static_cast<FeatureIndex>(i));
    }
  }
  return found;
}

std::vector<FeatureIndex> LoopNearLine(const Features& features, int contrast,
                                       const ImageLine& line, double band) {
  std::vector<FeatureIndex> found;
  for (size_t i = 0; i < features.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    if (ContrastClassOf(k.contrast_sign) != contrast) continue;
    if (std::abs(line.a * k.x_px + line.b * k.y_px + line.c) <= band * std::hypot(line.a, line.b)) {
      found.push_back(static_cast<FeatureIndex>(i));
    }
  }
  return found;
}

std::vector<FeatureIndex> GridNearPoint(const FeatureGrid& grid, int contrast, double x, double y,
                                        double radius) {
  std::vector<FeatureIndex> found;
  grid.FindNearPoint(contrast, x, y, radius, &found);
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<FeatureIndex> GridNearLine(const FeatureGrid& grid, int contrast, const ImageLine& line,
                                       double band) {
  std::vector<FeatureIndex> found;
  grid.FindNearLine(contrast, line, band, &found);
  std::sort(found.begin(), found.end());
  return found;
}

void CompareQueries(const Features& features, double width, double height, uint64_t seed) {
  const FeatureGrid grid(features);
  SeededRandom random(seed);
  size_t found_count = 0;
  for (int query = 0; query < 150; ++query) {
    const int contrast = static_cast<int>(random.Below(kContrastClassCount));
    const double x = std::floor((random.Unit() * 1.4 - 0.2) * width);
    const double y = (random.Unit() * 1.4 - 0.2) * height;
    const double radius =
        query % 10 == 0 ? 0.0 : std::floor(std::pow(random.Unit(), 3) * width / 2);
    const std::vector<FeatureIndex> near = LoopNearPoint(features, contrast, x, y, radius);
    ASSERT_EQ(GridNearPoint(grid, contrast, x, y, radius), near) << x << " " << y << " " << radius;
    // Lines of every slant, some along the axes, some far outside, at scales far from 1.
    const double angle = query % 4 == 0 ? M_PI / 4 * random.Below(8) : random.Unit() * 2 * M_PI;
    const double scale = std::pow(10.0, static_cast<int>(random.Below(13)) - 6);
    ImageLine line = {std::cos(angle) * scale, std::sin(angle) * scale, 0};
    line.c = -(line.a * x + line.b * y);
    const double band = query % 10 == 1 ? 0.0 : random.Unit() * 8;
    const std::vector<FeatureIndex> along = LoopNearLine(features, contrast, line, band);
    ASSERT_EQ(GridNearLine(grid, contrast, line, band), along)
        << angle << " " << x << " " << y << " " << band;
    found_count += near.size() + along.size();
  }
  if (features.size() > 100) {
    EXPECT_GT(found_count, 100u);
  }
}

TEST(FeatureGrid, EqualsLoopsOnSpreadKeypoints) {
  for (const uint32_t count : {0u, 1u, 2u, 50u, 4200u})
    CompareQueries(RandomKeypoints(count, 1536, 1024, count), 1536, 1024, 5);
}

TEST(FeatureGrid, EqualsLoopsOnStrangeShapes) {
  CompareQueries(RandomKeypoints(500, 3, 2, 1), 3, 2, 1);        // all in one cell
  CompareQueries(RandomKeypoints(500, 1536, 0, 2), 1536, 1, 2);  // on a row
  CompareQueries(RandomKeypoints(500, 0, 1024, 3), 1, 1024, 3);  // on a column
  CompareQueries(RandomKeypoints(500, 40'000, 30'000, 4), 40'000, 30'000, 4);
  Features same = RandomKeypoints(300, 1, 1, 5);
  for (Keypoint& keypoint : same.keypoints) keypoint.x_px = keypoint.y_px = 7.25f;
  CompareQueries(same, 14, 14, 5);
}

TEST(FeatureGrid, SurvivesWhatIsNotFinite) {
  Features features = RandomKeypoints(200, 100, 100, 6);
  features.keypoints[3].x_px = std::numeric_limits<float>::quiet_NaN();
  features.keypoints[4].y_px = std::numeric_limits<float>::infinity();
  features.keypoints[5].x_px = std::numeric_limits<float>::max();
  features.keypoints[6].y_px = -std::numeric_limits<float>::max();
  for (int i = 3; i <= 6; ++i) features.keypoints[i].contrast_sign = 1;
  const FeatureGrid grid(features);
  EXPECT_EQ(grid.feature_count(), 200u);
  EXPECT_LT(grid.size_bytes(), 100'000u);  // the room follows the keypoints, not their extent
  EXPECT_EQ(GridNearPoint(grid, 2, 50, 50, 200), LoopNearPoint(features, 2, 50, 50, 200));
  EXPECT_EQ(GridNearLine(grid, 2, {1, 0, -50}, 8), LoopNearLine(features, 2, {1, 0, -50}, 8));
  EXPECT_FALSE(GridNearPoint(grid, 2, 50, 50, 200).empty());
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_TRUE(GridNearPoint(grid, 2, bad, 50, 10).empty());
    EXPECT_TRUE(GridNearPoint(grid, 2, 50, bad, 10).empty());
    EXPECT_TRUE(GridNearPoint(grid, 2, 50, 50, bad).empty());
    EXPECT_TRUE(GridNearLine(grid, 2, {bad, 1, 0}, 2).empty());
    EXPECT_TRUE(GridNearLine(grid, 2, {1, bad, 0}, 2).empty());
    EXPECT_TRUE(GridNearLine(grid, 2, {1, 1, bad}, 2).empty());
    EXPECT_TRUE(GridNearLine(grid, 2, {1, 1, 0}, bad).empty());
  }
  EXPECT_TRUE(GridNearPoint(grid, 2, 50, 50, -1).empty());
  EXPECT_TRUE(GridNearLine(grid, 2, {0, 0, 0}, 2).empty());
  EXPECT_TRUE(GridNearLine(grid, 2, {0, 0, 1}, 2).empty());
}

}  // namespace
}  // namespace veduta
