// SPDX-License-Identifier: Apache-2.0
// Goal: a descriptor is what descriptor.h says, to within rounding of its bytes.
// Method: textures beside plain double-precision loops over the turned grid; keypoints of all sizes
//   and directions, some of which reach beyond the plane.
#include "engine/features/descriptor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/engine/features/blob_scene.h"
#include "tests/engine/features/plane_of.h"

namespace veduta {
namespace {

double ValueAt(const OwnedPlane& plane, double x, double y) {
  x = std::clamp(x, 0.0, plane.width() - 2.0);
  y = std::clamp(y, 0.0, plane.height() - 2.0);
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const double fx = x - u, fy = y - v;
  return (1 - fy) * ((1 - fx) * plane.at(u, v) + fx * plane.at(u + 1, v)) +
         fy * ((1 - fx) * plane.at(u, v + 1) + fx * plane.at(u + 1, v + 1));
}

// A gradient's weight in spatial bin c of its column or row, with the window's.
double Weight(int i, int c) {
  const double bin = (i - 9.5) / 4;
  return std::max(0.0, 1 - std::abs(bin - (c - 1.5))) * std::exp(-0.5 * bin * bin / 4);
}

std::array<uint8_t, 128> PlainDescriptor(const OwnedPlane& plane, double x, double y, double sigma,
                                         double angle_deg) {
  const double step = 0.75 * sigma, a = angle_deg * M_PI / 180;
  const auto value = [&](int i, int j) {
    const double u = step * (i - 10.5), v = step * (j - 10.5);
    return ValueAt(plane, x + std::cos(a) * u - std::sin(a) * v,
                   y + std::sin(a) * u + std::cos(a) * v);
  };
  std::array<double, 128> bins{};
  for (int j = 0; j < 20; ++j) {
    for (int i = 0; i < 20; ++i) {
      const double dx = value(i + 2, j + 1) - value(i, j + 1);
      const double dy = value(i + 1, j + 2) - value(i + 1, j);
      const double eighths = std::fmod(std::atan2(dy, dx) * 4 / M_PI + 8, 8);
      for (int k = 0; k < 128; ++k) {
        const double apart = std::abs(k % 8 - eighths);
        const double share = std::max(0.0, 1 - std::min(apart, 8 - apart));
        bins[k] += Weight(j, k / 32) * Weight(i, k / 8 % 4) * share * std::hypot(dx, dy);
      }
    }
  }
  double squares = 0, sum = 0;
  for (const double bin : bins) squares += bin * bin;
  for (double& bin : bins) sum += bin = std::min(bin, 0.2 * std::sqrt(squares));
  std::array<uint8_t, 128> bytes{};
  for (int k = 0; k < 128; ++k) {
    bytes[k] = static_cast<uint8_t>(std::min(255.0, 512 * std::sqrt(bins[k] / sum) + 0.5));
  }
  return bytes;
}

TEST(Descriptor, EqualsPlainLoopsButForRounding) {
  const DescriptorMaker maker(BestSiftKernels());
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    const OwnedPlane plane(Draw(140, 110, 128, MakeTexture(seed, 120, 140, 110)));
    SeededRandom random(MixSeed(seed, 1));
    for (int trial = 0; trial < 20; ++trial) {
      const double x = 5 + 130 * random.Unit(), y = 5 + 100 * random.Unit();
      const double sigma = 1.6 + 2.5 * random.Unit();
      const float angle_deg = static_cast<float>(360 * random.Unit());
      std::array<uint8_t, 128> made{};
      maker.Make(plane.view(), x, y, sigma, angle_deg, made.data());
      const std::array<uint8_t, 128> plain = PlainDescriptor(plane, x, y, sigma, angle_deg);
      double squares = 0;
      for (int k = 0; k < 128; ++k) {
        EXPECT_NEAR(made[k], plain[k], 1)
            << "seed " << seed << ", trial " << trial << ", bin " << k;
        squares += made[k] * made[k];
      }
      EXPECT_NEAR(std::sqrt(squares), 512, 8);
    }
  }
}

TEST(Descriptor, AFlatPlaneGivesZeros) {
  const OwnedPlane plane(64, 64);
  std::vector<uint8_t> made(128, 7);
  DescriptorMaker(BestSiftKernels()).Make(plane.view(), 32, 32, 2, 30, made.data());
  EXPECT_EQ(made, std::vector<uint8_t>(128, 0));
}

}  // namespace
}  // namespace veduta
