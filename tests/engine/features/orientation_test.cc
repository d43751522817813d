// SPDX-License-Identifier: Apache-2.0
// Goal: the directions of a keypoint are the peaks of the gradients around it.
// Method: textures beside a histogram in plain double-precision loops. A peak that is clearly above
//   the share of the highest must be found, one clearly below must not; gradients that lie on a
//   bin's border may move a peak by little.
#include "engine/features/orientation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/engine/features/blob_scene.h"
#include "tests/engine/features/plane_of.h"

namespace veduta {
namespace {

struct Peak {
  double angle_deg = 0;
  double share = 0;  // of the highest
};

std::vector<Peak> PlainPeaks(const GrayPlane& plane, double x, double y, double sigma) {
  const double window = 1.5 * sigma;
  const int radius = std::clamp(static_cast<int>(3 * window + 0.5), 1, kOrientationRadiusMax);
  const int cx = static_cast<int>(x + 0.5), cy = static_cast<int>(y + 0.5);
  std::array<double, kOrientationBins> raw{}, smooth{};
  for (int v = std::max(1, cy - radius); v <= std::min(plane.height - 2, cy + radius); ++v) {
    for (int u = std::max(1, cx - radius); u <= std::min(plane.width - 2, cx + radius); ++u) {
      if ((u - cx) * (u - cx) + (v - cy) * (v - cy) > radius * radius) continue;
      const int16_t* p = plane.pixels + v * plane.stride + u;
      const double dx = p[1] - p[-1], dy = p[plane.stride] - p[-plane.stride];
      const double turn = std::atan2(dy, dx) / (2 * M_PI) + (dy < 0 ? 1 : 0);
      const double apart = (u - x) * (u - x) + (v - y) * (v - y);
      raw[static_cast<size_t>(turn * kOrientationBins + 0.5) % kOrientationBins] +=
          std::hypot(dx, dy) * std::exp(-0.5 * apart / (window * window));
    }
  }
  const auto at = [](const auto& bins, int i) { return bins[(i + 36) % 36]; };
  for (int i = 0; i < kOrientationBins; ++i) {
    smooth[i] = (at(raw, i - 2) + 4 * at(raw, i - 1) + 6 * at(raw, i) + 4 * at(raw, i + 1) +
                 at(raw, i + 2)) /
                16;
  }
  const double highest = *std::max_element(smooth.begin(), smooth.end());
  std::vector<Peak> peaks;
  for (int i = 0; i < kOrientationBins; ++i) {
    const double left = at(smooth, i - 1), here = smooth[i], right = at(smooth, i + 1);
    if (here <= left || here <= right) continue;
    const double bin = i + 0.5 * (left - right) / (left - 2 * here + right);
    peaks.push_back({std::fmod(bin * 10 + 360, 360), here / highest});
  }
  return peaks;
}

// A texture averaged over 3 x 3 pixels, with a little noise. Without these, many gradients would be
// small whole gray levels, whose directions lie exactly on the borders of bins.
OwnedPlane SmoothTexture(uint64_t seed) {
  const OwnedPlane sharp(Draw(120, 100, 128, MakeTexture(seed, 80, 120, 100)));
  SeededRandom random(seed);
  OwnedPlane smooth(120, 100);
  for (int y = 1; y < 99; ++y) {
    for (int x = 1; x < 119; ++x) {
      int sum = 0;
      for (int k = 0; k < 9; ++k) sum += sharp.at(x + k % 3 - 1, y + k / 3 - 1);
      smooth.at(x, y) = static_cast<int16_t>(sum / 9 + static_cast<int>(random.Below(100)));
    }
  }
  return smooth;
}

double Apart(double a_deg, double b_deg) {
  return std::abs(std::remainder(a_deg - b_deg, 360));
}

TEST(Orientation, FindsThePeaksOfThePlainHistogram) {
  int found_count = 0;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const OwnedPlane plane = SmoothTexture(seed);
    SeededRandom random(seed);
    for (int trial = 0; trial < 20; ++trial) {
      // Some of them near the border, where the window is cut off.
      const double x = 6 + 108 * random.Unit(), y = 6 + 88 * random.Unit();
      const double sigma = 1.6 + 3 * random.Unit();
      const std::vector<Peak> peaks = PlainPeaks(plane.view(), x, y, sigma);
      const Directions found = FindDirections(BestSiftKernels(), plane.view(), x, y, sigma);
      ASSERT_GE(found.count, 1);
      for (int i = 0; i < found.count; ++i) {
        EXPECT_TRUE(std::any_of(peaks.begin(), peaks.end(),
                                [&](const Peak& peak) {
                                  return peak.share > 0.79 &&
                                         Apart(peak.angle_deg, found.angle_deg[i]) < 2;
                                }))
            << "seed " << seed << ", trial " << trial << ": " << found.angle_deg[i];
        ++found_count;
      }
      for (const Peak& peak : peaks) {
        if (peak.share < 0.81) continue;
        EXPECT_TRUE(std::any_of(found.angle_deg, found.angle_deg + found.count,
                                [&](float angle) { return Apart(peak.angle_deg, angle) < 2; }))
            << "seed " << seed << ", trial " << trial << ": " << peak.angle_deg;
      }
    }
  }
  EXPECT_GT(found_count, 250) << "several keypoints must have two directions";
}

TEST(Orientation, ARampHasOneDirection) {
  for (int angle_deg = 0; angle_deg < 360; angle_deg += 10) {
    const double cosine = std::cos(angle_deg * M_PI / 180), sine = std::sin(angle_deg * M_PI / 180);
    OwnedPlane plane(90, 90);
    for (int y = 0; y < 90; ++y) {
      for (int x = 0; x < 90; ++x) {
        plane.at(x, y) = static_cast<int16_t>(std::lround(100 * (cosine * x + sine * y)));
      }
    }
    const Directions found = FindDirections(BestSiftKernels(), plane.view(), 45, 45, 3);
    ASSERT_EQ(found.count, 1) << angle_deg;
    EXPECT_LT(Apart(found.angle_deg[0], angle_deg), 0.5);
  }
}

TEST(Orientation, AFlatPlaneHasADirectionToo) {
  OwnedPlane plane(60, 60);
  EXPECT_EQ(FindDirections(BestSiftKernels(), plane.view(), 30, 30, 2).count, 1);
}

}  // namespace
}  // namespace veduta
