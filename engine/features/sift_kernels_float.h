// SPDX-License-Identifier: Apache-2.0
#pragma once
// Vectors of 8 floats and of 8 integers of 32 bits, on any processor: the compiler splits them
// where registers are narrower, so the operations and their order are the same everywhere. They are
// in an unnamed namespace, so that each including source has its own.

#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace veduta {
namespace {

typedef float F8 __attribute__((vector_size(32)));
typedef int32_t N8 __attribute__((vector_size(32)));

inline F8 FillF(float v) {
  return v - F8{};
}
inline F8 LoadF(const float* p) {
  F8 v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
inline void StoreF(float* p, F8 v) {
  __builtin_memcpy(p, &v, sizeof(v));
}
inline void StoreN(int32_t* p, N8 v) {
  __builtin_memcpy(p, &v, sizeof(v));
}
inline F8 MaxF(F8 a, F8 b) {
  return a > b ? a : b;
}
inline F8 MinF(F8 a, F8 b) {
  return a < b ? a : b;
}
inline F8 AbsF(F8 a) {
  return (F8)((N8)a & 0x7FFFFFFF);
}
inline F8 ToFloat(N8 a) {
  return __builtin_convertvector(a, F8);
}
inline N8 Truncate(F8 a) {
  return __builtin_convertvector(a, N8);
}
inline F8 RootF(F8 a) {
#if defined(__AVX__)
  return (F8)_mm256_sqrt_ps((__m256)a);
#elif defined(__SSE2__)
  __m128 half[2];
  __builtin_memcpy(half, &a, sizeof(a));
  half[0] = _mm_sqrt_ps(half[0]);
  half[1] = _mm_sqrt_ps(half[1]);
  __builtin_memcpy(&a, half, sizeof(a));
  return a;
#else
  for (int i = 0; i < 8; ++i) a[i] = __builtin_sqrtf(a[i]);
  return a;
#endif
}
// Eight differences a[i] - b[i], widened. Those that count fit 16 bits; what a caller reads beyond
// a row and drops may be anything, so the subtraction wraps.
inline N8 WidenDifference(const int16_t* a, const int16_t* b) {
  typedef uint16_t Word8 __attribute__((vector_size(16)));
  Word8 u, v;
  __builtin_memcpy(&u, a, sizeof(u));
  __builtin_memcpy(&v, b, sizeof(v));
#if defined(__AVX2__)
  return (N8)_mm256_cvtepi16_epi32((__m128i)(u - v));
#else
  typedef int16_t Short8 __attribute__((vector_size(16)));
  return __builtin_convertvector((Short8)(u - v), N8);
#endif
}

}  // namespace
}  // namespace veduta
