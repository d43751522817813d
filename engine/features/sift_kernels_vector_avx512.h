// SPDX-License-Identifier: Apache-2.0
#pragma once
// The vectors of sift_kernels_vector.h, which says what each operation does, in 512 bits:
// AVX-512 BW.

#include <immintrin.h>

#include <cstdint>

namespace veduta {
namespace {

using I16 = __m512i;
using Mask = __mmask32;
constexpr int kLanes = 32;
constexpr int kLaneShift = 0;

inline I16 Load(const int16_t* p) {
  return _mm512_loadu_si512(p);
}
inline void Store(int16_t* p, I16 v) {
  _mm512_storeu_si512(p, v);
}
inline I16 Fill(int v) {
  return _mm512_set1_epi16(static_cast<int16_t>(v));
}
inline I16 FillPair(const int16_t* p) {
  int32_t pair;
  __builtin_memcpy(&pair, p, 4);
  return _mm512_set1_epi32(pair);
}
inline I16 Zero() {
  return _mm512_setzero_si512();
}
inline I16 Add16(I16 a, I16 b) {
  return _mm512_add_epi16(a, b);
}
inline I16 Sub16(I16 a, I16 b) {
  return _mm512_sub_epi16(a, b);
}
inline I16 Max16(I16 a, I16 b) {
  return _mm512_max_epi16(a, b);
}
inline I16 Min16(I16 a, I16 b) {
  return _mm512_min_epi16(a, b);
}
inline I16 InterleaveLow(I16 a, I16 b) {
  return _mm512_unpacklo_epi16(a, b);
}
inline I16 InterleaveHigh(I16 a, I16 b) {
  return _mm512_unpackhi_epi16(a, b);
}
inline I16 Add32(I16 a, I16 b) {
  return _mm512_add_epi32(a, b);
}
inline I16 MulAdd(I16 a, I16 b) {
  return _mm512_madd_epi16(a, b);
}
inline I16 Round15(I16 a) {
  return _mm512_srai_epi32(_mm512_add_epi32(a, _mm512_set1_epi32(1 << 14)), 15);
}
inline I16 PackRound(I16 low, I16 high) {
  return _mm512_packs_epi32(Round15(low), Round15(high));
}
inline I16 MergeRound(I16 even, I16 odd) {
  const I16 half = _mm512_set1_epi32(1 << 14);
  return _mm512_mask_blend_epi16(0xAAAAAAAAu, _mm512_srli_epi32(_mm512_add_epi32(even, half), 15),
                                 _mm512_slli_epi32(_mm512_add_epi32(odd, half), 1));
}
inline Mask Greater(I16 a, I16 b) {
  return _mm512_cmpgt_epi16_mask(a, b);
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
  return m;
}

}  // namespace
}  // namespace veduta
