// SPDX-License-Identifier: Apache-2.0
// The kernels in plain C++: what the vector ones must equal.
#include "index/center_kernels.h"

namespace veduta {
namespace {

int32_t Score(const uint8_t* descriptor, const uint8_t* center, int32_t bias) {
  int32_t dot = 0;
  for (int j = 0; j < kCenterSize; ++j) dot += center[j] * (descriptor[j] - 128);
  return bias - 2 * dot;
}

uint32_t Nearest(const uint8_t* descriptor, const uint8_t* centers, const int32_t* biases,
                 uint32_t count, int32_t* score) {
  uint32_t best = 0;
  int32_t best_score = Score(descriptor, centers, biases[0]);
  for (uint32_t i = 1; i < count; ++i) {
    const int32_t s = Score(descriptor, centers + i * kCenterSize, biases[i]);
    if (s < best_score) {
      best = i;
      best_score = s;
    }
  }
  *score = best_score;
  return best;
}

void NearestEach(const uint8_t* descriptors, size_t n, const uint8_t* centers,
                 const int32_t* biases, uint32_t count, uint8_t* nearest, int32_t* scores) {
  for (size_t i = 0; i < n; ++i) {
    nearest[i] = static_cast<uint8_t>(
        Nearest(descriptors + i * kCenterSize, centers, biases, count, scores + i));
  }
}

void Accumulate(const uint8_t* descriptors, size_t n, const uint8_t* nearest, uint32_t* sums) {
  for (size_t i = 0; i < n; ++i) {
    const uint8_t* descriptor = descriptors + i * kCenterSize;
    uint32_t* sum = sums + static_cast<size_t>(nearest[i]) * kCenterSize;
    for (int j = 0; j < kCenterSize; ++j) sum[j] += descriptor[j];
  }
}

constexpr CenterKernels kKernels = {Nearest, NearestEach, Accumulate};

}  // namespace

const CenterKernels* const kCenterKernelsPortable = &kKernels;

}  // namespace veduta
