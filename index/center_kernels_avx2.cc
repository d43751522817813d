// SPDX-License-Identifier: Apache-2.0
// Built with -mavx2. Bytes are widened to 16 bits; vpmaddubsw needs no widening, but it saturates.
#include "index/center_kernels.h"

#if defined(__AVX2__)
#include "index/center_lanes.h"

namespace veduta {
namespace {

constexpr int kParts = kCenterSize / 16;

inline __m256i Widen(const uint8_t* bytes) {
  return _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes)));
}

inline uint32_t Nearest(const uint8_t* descriptor, const uint8_t* centers, const int32_t* biases,
                        uint32_t count, int32_t* score) {
  __m256i d[kParts];
  for (int p = 0; p < kParts; ++p)
    d[p] = _mm256_sub_epi16(Widen(descriptor + 16 * p), _mm256_set1_epi16(128));
  Lanes lanes;
  for (uint32_t i = 0; i < count; i += 4) {
    __m256i sums[4];
    for (uint32_t r = 0; r < 4; ++r) {
      const uint8_t* row = centers + (i + r < count ? i + r : i) * kCenterSize;
      sums[r] = _mm256_setzero_si256();
      for (int p = 0; p < kParts; ++p) {
        sums[r] = _mm256_add_epi32(sums[r], _mm256_madd_epi16(d[p], Widen(row + 16 * p)));
      }
    }
    lanes.Update(AddLanes(sums[0], sums[1], sums[2], sums[3]), biases, i, count);
  }
  return lanes.Least(score);
}

void NearestEach(const uint8_t* descriptors, size_t n, const uint8_t* centers,
                 const int32_t* biases, uint32_t count, uint8_t* nearest, int32_t* scores) {
  for (size_t i = 0; i < n; ++i) {
    nearest[i] = static_cast<uint8_t>(
        Nearest(descriptors + i * kCenterSize, centers, biases, count, scores + i));
  }
}

constexpr CenterKernels kKernels = {Nearest, NearestEach, Accumulate};

}  // namespace

const CenterKernels* const kCenterKernelsAvx2 = &kKernels;

}  // namespace veduta
#else
namespace veduta {
const CenterKernels* const kCenterKernelsAvx2 = nullptr;
}
#endif
