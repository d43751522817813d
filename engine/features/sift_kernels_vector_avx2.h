// SPDX-License-Identifier: Apache-2.0
#pragma once
// The vectors of sift_kernels_vector.h, which says what each operation does, in 256 bits: AVX2.

#include <immintrin.h>

#include <cstdint>

namespace veduta {
namespace {

using I16 = __m256i;
using Mask = __m256i;
constexpr int kLanes = 16;
constexpr int kLaneShift = 1;

inline I16 Load(const int16_t* p) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
}
inline void Store(int16_t* p, I16 v) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), v);
}
inline I16 Fill(int v) {
  return _mm256_set1_epi16(static_cast<int16_t>(v));
}
inline I16 FillPair(const int16_t* p) {
  int32_t pair;
  __builtin_memcpy(&pair, p, 4);
  return _mm256_set1_epi32(pair);
}
inline I16 Zero() {
  return _mm256_setzero_si256();
}
inline I16 Add16(I16 a, I16 b) {
  return _mm256_add_epi16(a, b);
}
inline I16 Sub16(I16 a, I16 b) {
  return _mm256_sub_epi16(a, b);
}
inline I16 Max16(I16 a, I16 b) {
  return _mm256_max_epi16(a, b);
}
inline I16 Min16(I16 a, I16 b) {
  return _mm256_min_epi16(a, b);
}
inline I16 InterleaveLow(I16 a, I16 b) {
  return _mm256_unpacklo_epi16(a, b);
}
inline I16 InterleaveHigh(I16 a, I16 b) {
  return _mm256_unpackhi_epi16(a, b);
}
inline I16 Add32(I16 a, I16 b) {
  return _mm256_add_epi32(a, b);
}
inline I16 MulAdd(I16 a, I16 b) {
  return _mm256_madd_epi16(a, b);
}
inline I16 Round15(I16 a) {
  return _mm256_srai_epi32(_mm256_add_epi32(a, _mm256_set1_epi32(1 << 14)), 15);
}
inline I16 PackRound(I16 low, I16 high) {
  return _mm256_packs_epi32(Round15(low), Round15(high));
}
inline I16 MergeRound(I16 even, I16 odd) {
  const I16 half = _mm256_set1_epi32(1 << 14);
  return _mm256_blend_epi16(_mm256_srli_epi32(_mm256_add_epi32(even, half), 15),
                            _mm256_slli_epi32(_mm256_add_epi32(odd, half), 1), 0xAA);
}
inline Mask Greater(I16 a, I16 b) {
  return _mm256_cmpgt_epi16(a, b);
}
inline Mask And(Mask a, Mask b) {
  return _mm256_and_si256(a, b);
}
inline Mask AndNot(Mask a, Mask b) {
  return _mm256_andnot_si256(b, a);
}
inline Mask Or(Mask a, Mask b) {
  return _mm256_or_si256(a, b);
}
inline uint32_t Bits(Mask m) {
  return static_cast<uint32_t>(_mm256_movemask_epi8(m)) & 0x55555555u;
}

}  // namespace
}  // namespace veduta
