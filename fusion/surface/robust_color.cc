// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/robust_color.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace veduta {
namespace {

constexpr float kSigmaOfMad = 1.4826f;  // 1 / the normal distribution's 0.75 quantile

struct Weighted {
  float value, weight;
  uint32_t rank;  // of the sample: the heavier of equal values comes first
};

// The least value at which half of the weight is reached.
float WeightedMedian(std::vector<Weighted>& list) {
  std::sort(list.begin(), list.end(), [](const Weighted& a, const Weighted& b) {
    return a.value != b.value ? a.value < b.value : a.rank < b.rank;
  });
  float total = 0, sum = 0;
  for (const Weighted& w : list) total += w.weight;
  for (const Weighted& w : list) {
    sum += w.weight;
    if (2 * sum >= total) return w.value;
  }
  return list.back().value;
}

}  // namespace

RobustColor RobustMean(std::span<ColorSample> samples, uint32_t count_max, float deviations,
                       float tolerance) {
  if (samples.empty()) return {};
  std::sort(samples.begin(), samples.end(), [](const ColorSample& a, const ColorSample& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.image < b.image;
  });
  const uint32_t count = static_cast<uint32_t>(std::min<size_t>(samples.size(), count_max));
  thread_local std::vector<Weighted> list;
  Eigen::Vector3f median;
  for (int c = 0; c < 3; ++c) {
    list.clear();
    for (uint32_t i = 0; i < count; ++i)
      list.push_back({std::sqrt(samples[i].light[c]), samples[i].weight, i});
    median[c] = WeightedMedian(list);
  }
  thread_local std::vector<float> distance;
  distance.clear();
  list.clear();
  for (uint32_t i = 0; i < count; ++i) {
    distance.push_back((samples[i].light.cwiseSqrt() - median).cwiseAbs().maxCoeff());
    list.push_back({distance[i], samples[i].weight, i});
  }
  const float limit = std::max(tolerance, deviations * kSigmaOfMad * WeightedMedian(list));
  RobustColor mean;
  float total = 0;
  for (uint32_t i = 0; i < count; ++i) {
    if (distance[i] > limit) continue;
    mean.light += samples[i].weight * samples[i].light;
    total += samples[i].weight;
    ++mean.count;
  }
  if (mean.count == 0)
    return {samples[0].light, 1};  // channels' medians from different samples: nobody is near
  mean.light /= total;
  return mean;
}

}  // namespace veduta
