// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/matching/multiply_peak.h"

#if defined(__AVX512VNNI__)
#include <immintrin.h>
#endif

namespace veduta {

uint64_t MultiplyAvx512Vnni(uint64_t rounds) {
#if defined(__AVX512VNNI__)
  const __m512i factor = _mm512_set1_epi8(3);
  const __m512i bytes = _mm512_set1_epi8(5);
  __m512i s0 = bytes, s1 = bytes, s2 = bytes, s3 = bytes, s4 = bytes, s5 = bytes;
  __m512i s6 = bytes, s7 = bytes, s8 = bytes, s9 = bytes, s10 = bytes, s11 = bytes;
  const auto step = [&](__m512i & sum) __attribute__((always_inline)) {
    sum = _mm512_dpbusd_epi32(sum, bytes, factor);
    asm volatile("" : "+v"(sum));
  };
  for (uint64_t i = 0; i < rounds; ++i) {
    step(s0), step(s1), step(s2), step(s3), step(s4), step(s5);
    step(s6), step(s7), step(s8), step(s9), step(s10), step(s11);
  }
  return rounds * 12 * 64;
#else
  return 0 * rounds;
#endif
}

}  // namespace veduta
