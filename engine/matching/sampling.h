// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every RANSAC here shares: how to draw samples of distinct matches, the most trustworthy
// first, and how many samples are enough.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {

// Fills `sample` with distinct numbers below n (n >= sample.size()).
inline void DrawDistinct(SeededRandom& random, uint32_t n, std::vector<int>& sample) {
  for (size_t k = 0; k < sample.size(); ++k) {
    bool fresh;
    do {
      sample[k] = static_cast<int>(random.Below(n));
      fresh = std::find(sample.begin(), sample.begin() + k, sample[k]) == sample.begin() + k;
    } while (!fresh);
  }
}

// Matches are sorted best first. Sample number t may draw from the first so many of them: from
// `front` at first, from all n after 200 samples (chosen by hand; PROSAC, Chum and Matas 2005, has
// the idea).
inline uint32_t FrontCount(uint32_t n, uint32_t t, uint32_t front) {
  return std::min(n, std::max(front, static_cast<uint32_t>(uint64_t{n} * t / 200)));
}

// How many samples of `size` matches it takes until one of them is free of outliers with the given
// confidence (Fischler and Bolles 1981).
inline uint32_t SamplesNeeded(double confidence, double inlier_share, int size) {
  const double clean = std::pow(inlier_share, size);
  if (clean >= 1) return 1;
  const double needed = std::log(1 - confidence) / std::log1p(-clean);
  return needed < 1e9 ? static_cast<uint32_t>(std::ceil(needed)) : 1'000'000'000u;
}

// Matches as arrays, so that counting inliers vectorises.
struct MatchArrays {
  std::vector<double> ax, ay, bx, by;

  MatchArrays(std::span<const Eigen::Vector2d> a, std::span<const Eigen::Vector2d> b) {
    for (size_t i = 0; i < a.size(); ++i) {
      ax.push_back(a[i].x()), ay.push_back(a[i].y());
      bx.push_back(b[i].x()), by.push_back(b[i].y());
    }
  }
  size_t size() const { return ax.size(); }
};

}  // namespace veduta
