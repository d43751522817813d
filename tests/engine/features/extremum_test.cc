// SPDX-License-Identifier: Apache-2.0
// Goal: an extremum is placed between the samples where the differences have it, and refused where
//   it is weak, an edge, or outside.
// Method: levels whose differences are a known quadric, rounded to integers; searches that start
//   beside its top.
#include "engine/features/extremum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/engine/features/plane_of.h"

namespace veduta {
namespace {

constexpr int kSize = 48;

struct Top {
  double x = 20.3, y = 17.7, level = 2.2;
  double height = 3000;
  double x_bend = 30, y_bend = 25, level_bend = 200;
};

// The difference of level k + 1 and level k is height - x_bend (x - top)^2 - ...
class QuadricOctave final {
 public:
  explicit QuadricOctave(const Top& top) : levels_(kLevels, OwnedPlane(kSize, kSize)) {
    rows_.width = rows_.height = kSize;
    for (int k = 0; k < kLevels; ++k) {
      rows_.levels[k] = {levels_[k].row(0), levels_[k].stride(), kSize};
      for (int y = 0; y < kSize && k > 0; ++y) {
        for (int x = 0; x < kSize; ++x) {
          const double dx = x - top.x, dy = y - top.y, ds = k - 1 - top.level;
          const double value =
              top.height - top.x_bend * dx * dx - top.y_bend * dy * dy - top.level_bend * ds * ds;
          // Far from the top nobody looks; there the sums would not fit.
          levels_[k].at(x, y) = static_cast<int16_t>(
              levels_[k - 1].at(x, y) + std::lround(std::clamp(value, -5000.0, 5000.0)));
        }
      }
    }
  }
  const OctaveRows& rows() const { return rows_; }

 private:
  std::vector<OwnedPlane> levels_;
  OctaveRows rows_;
};

constexpr ExtremumLimits kLimits = {0.0133, 10};

TEST(Extremum, IsPlacedBetweenTheSamples) {
  for (const double sign : {1.0, -1.0}) {
    Top top;
    for (double* value : {&top.height, &top.x_bend, &top.y_bend, &top.level_bend}) *value *= sign;
    const QuadricOctave octave(top);
    for (int start = 0; start < 27; ++start) {
      const int x = 20 + start % 3 - 1, y = 18 + start / 3 % 3 - 1, level = 2 + start / 9 - 1;
      const auto found = RefineExtremum(octave.rows(), level, y, x, kLimits);
      ASSERT_TRUE(found) << "start " << start;
      EXPECT_EQ(found->column, 20);
      EXPECT_EQ(found->row, 18);
      EXPECT_EQ(found->level, 2);
      EXPECT_NEAR(found->x, top.x, 0.03);
      EXPECT_NEAR(found->y, top.y, 0.03);
      EXPECT_NEAR(found->level_offset, 0.2, 0.03);
      EXPECT_NEAR(found->contrast, top.height / (kGrayUnit * 255.0), 1e-3);
    }
  }
}

TEST(Extremum, StaysWithinItsSteps) {
  const QuadricOctave octave(Top{});
  EXPECT_TRUE(RefineExtremum(octave.rows(), 2, 18, 16, kLimits)) << "four samples away";
  EXPECT_FALSE(RefineExtremum(octave.rows(), 2, 18, 14, kLimits)) << "six samples away";
}

TEST(Extremum, RefusesWeakOnesEdgesAndSaddles) {
  const auto is_found = [](const Top& top, const ExtremumLimits& limits) {
    return RefineExtremum(QuadricOctave(top).rows(), 2, 18, 20, limits).has_value();
  };
  EXPECT_TRUE(is_found({}, kLimits));
  EXPECT_FALSE(is_found({}, {0.095, 10})) << "its contrast is 0.092";
  EXPECT_FALSE(is_found({.height = 300}, kLimits)) << "its contrast is 0.0092";
  EXPECT_TRUE(is_found({.x_bend = 270, .y_bend = 30}, kLimits)) << "a ratio of 9";
  EXPECT_FALSE(is_found({.x_bend = 330, .y_bend = 30}, kLimits)) << "a ratio of 11";
  EXPECT_TRUE(is_found({.x_bend = 330, .y_bend = 30}, {0.0133, 12}));
  EXPECT_FALSE(is_found({.y_bend = -25}, kLimits)) << "a saddle";
}

TEST(Extremum, RefusesWhatLeavesTheOctave) {
  const Top left = {.x = kExtremumBorder - 2.0};
  EXPECT_FALSE(RefineExtremum(QuadricOctave(left).rows(), 2, 18, kExtremumBorder, kLimits));
  const Top below = {.level = 0.1};
  EXPECT_FALSE(RefineExtremum(QuadricOctave(below).rows(), 1, 18, 20, kLimits));
  const Top above = {.level = 3.9};
  EXPECT_FALSE(RefineExtremum(QuadricOctave(above).rows(), 3, 18, 20, kLimits));
}

}  // namespace
}  // namespace veduta
