// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/matching/multiply_peak.h"

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace veduta {

uint64_t MultiplyAvx2(uint64_t rounds) {
#if defined(__AVX2__)
  const __m256i factor = _mm256_set1_epi16(3);
  __m256i bytes = _mm256_set1_epi16(5);
  __m256i s0 = bytes, s1 = bytes, s2 = bytes, s3 = bytes, s4 = bytes, s5 = bytes, s6 = bytes,
          s7 = bytes;
  const auto step = [&](__m256i & sum) __attribute__((always_inline)) {
    asm("" : "+x"(bytes));  // else the product is computed once
    sum = _mm256_add_epi32(sum, _mm256_madd_epi16(bytes, factor));
    asm volatile("" : "+x"(sum));
  };
  for (uint64_t i = 0; i < rounds; ++i) {
    step(s0), step(s1), step(s2), step(s3), step(s4), step(s5), step(s6), step(s7);
  }
  return rounds * 8 * 16;
#else
  return 0 * rounds;
#endif
}

}  // namespace veduta
