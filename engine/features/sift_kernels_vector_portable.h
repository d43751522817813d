// SPDX-License-Identifier: Apache-2.0
#pragma once
// The vectors of sift_kernels_vector.h, which says what each operation does, in 128 bits: the
// compiler's own vectors, with two instructions of SSE2 where there is that.

#include <cstdint>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace veduta {
namespace {

typedef int16_t I16 __attribute__((vector_size(16)));
typedef int32_t I32 __attribute__((vector_size(16)));
using Mask = I16;
constexpr int kLanes = 8;
constexpr int kLaneShift = 0;

inline I16 Load(const int16_t* p) {
  I16 v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}
inline void Store(int16_t* p, I16 v) {
  __builtin_memcpy(p, &v, sizeof(v));
}
inline I16 Fill(int v) {
  return static_cast<int16_t>(v) - I16{};
}
inline I16 FillPair(const int16_t* p) {
  int32_t pair;
  __builtin_memcpy(&pair, p, 4);
  return (I16)(pair - I32{});
}
inline I16 Zero() {
  return I16{};
}
inline I16 Add16(I16 a, I16 b) {
  return a + b;
}
inline I16 Sub16(I16 a, I16 b) {
  return a - b;
}
inline I16 Max16(I16 a, I16 b) {
  return a > b ? a : b;
}
inline I16 Min16(I16 a, I16 b) {
  return a < b ? a : b;
}
inline I16 InterleaveLow(I16 a, I16 b) {
  return __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11);
}
inline I16 InterleaveHigh(I16 a, I16 b) {
  return __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15);
}
inline I16 Add32(I16 a, I16 b) {
  return (I16)((I32)a + (I32)b);
}
inline I16 MulAdd(I16 a, I16 b) {
#if defined(__SSE2__)
  return (I16)_mm_madd_epi16((__m128i)a, (__m128i)b);
#else
  I32 sum;
  for (int i = 0; i < 4; ++i) sum[i] = a[2 * i] * b[2 * i] + a[2 * i + 1] * b[2 * i + 1];
  return (I16)sum;
#endif
}
inline I32 Round15(I16 a) {
  return ((I32)a + (1 << 14)) >> 15;
}
inline I16 PackRound(I16 low, I16 high) {
#if defined(__SSE2__)
  return (I16)_mm_packs_epi32((__m128i)Round15(low), (__m128i)Round15(high));
#else
  return __builtin_convertvector(
      __builtin_shufflevector(Round15(low), Round15(high), 0, 1, 2, 3, 4, 5, 6, 7), I16);
#endif
}
inline I16 MergeRound(I16 even, I16 odd) {
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  return (I16)((Round15(even) & 0xFFFF) | (Round15(odd) << 16));
#else
  return (I16)((Round15(even) << 16) | (Round15(odd) & 0xFFFF));
#endif
}
inline Mask Greater(I16 a, I16 b) {
  return a > b;
}
inline Mask And(Mask a, Mask b) {
  return a & b;
}
inline Mask AndNot(Mask a, Mask b) {
  return a & ~b;
}
inline Mask Or(Mask a, Mask b) {
  return a | b;
}
inline uint32_t Bits(Mask m) {
  typedef int64_t I64 __attribute__((vector_size(16)));
  const I64 words = (I64)m;
  if ((words[0] | words[1]) == 0) return 0;
  uint32_t bits = 0;
  for (int i = 0; i < 8; ++i) bits |= (m[i] != 0 ? 1u : 0u) << i;
  return bits;
}

}  // namespace
}  // namespace veduta
