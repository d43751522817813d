// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the AVX2 and the AVX-512 VNNI kernels share. It is in an unnamed namespace on purpose: each
// of the two files is compiled for other instructions and must keep its own copy.

#include <immintrin.h>

#include "index/center_kernels.h"

namespace veduta {
namespace {

// Four sums of eight lanes each become one vector of four totals.
inline __m128i AddLanes(__m256i a, __m256i b, __m256i c, __m256i d) {
  const __m256i sums = _mm256_hadd_epi32(_mm256_hadd_epi32(a, b), _mm256_hadd_epi32(c, d));
  return _mm_add_epi32(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
}

// The least score so far in each of four lanes, and which centre has it.
struct Lanes {
  __m128i scores = _mm_set1_epi32(INT32_MAX);
  __m128i indices = _mm_setzero_si128();

  // Scores of the centres i..i+3, of which those from `count` on do not exist.
  inline void Update(__m128i dots, const int32_t* biases, uint32_t i, uint32_t count) {
    const __m128i index =
        _mm_add_epi32(_mm_set1_epi32(static_cast<int32_t>(i)), _mm_setr_epi32(0, 1, 2, 3));
    const __m128i exists = _mm_cmpgt_epi32(_mm_set1_epi32(static_cast<int32_t>(count)), index);
    const __m128i bias = _mm_maskload_epi32(biases + i, exists);
    const __m128i candidates = _mm_sub_epi32(bias, _mm_add_epi32(dots, dots));
    const __m128i better = _mm_and_si128(exists, _mm_cmpgt_epi32(scores, candidates));
    scores = _mm_blendv_epi8(scores, candidates, better);
    indices = _mm_blendv_epi8(indices, index, better);
  }

  inline uint32_t Least(int32_t* score) const {
    alignas(16) int32_t s[4], index[4];
    _mm_store_si128(reinterpret_cast<__m128i*>(s), scores);
    _mm_store_si128(reinterpret_cast<__m128i*>(index), indices);
    int32_t best = 0;
    for (int r = 1; r < 4; ++r) {
      const bool better = s[r] < s[best] || (s[r] == s[best] && index[r] < index[best]);
      best = better ? r : best;
    }
    *score = s[best];
    return static_cast<uint32_t>(index[best]);
  }
};

// CenterKernels::accumulate.
inline void Accumulate(const uint8_t* descriptors, size_t n, const uint8_t* nearest,
                       uint32_t* sums) {
  for (size_t i = 0; i < n; ++i) {
    const uint8_t* descriptor = descriptors + i * kCenterSize;
    __m256i* sum = reinterpret_cast<__m256i*>(sums + static_cast<size_t>(nearest[i]) * kCenterSize);
    for (int j = 0; j < kCenterSize / 8; ++j) {
      const __m256i wide = _mm256_cvtepu8_epi32(
          _mm_loadl_epi64(reinterpret_cast<const __m128i*>(descriptor + 8 * j)));
      _mm256_storeu_si256(sum + j, _mm256_add_epi32(_mm256_loadu_si256(sum + j), wide));
    }
  }
}

}  // namespace
}  // namespace veduta
