// SPDX-License-Identifier: Apache-2.0
#pragma once
// Vectors of 16-bit integers as wide as the flags of the including source allow, with the few operations the kernels
// need. Everything is in an unnamed namespace: each including source has its own.

#include <cstddef>
#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace veduta {
namespace {

// MulAdd: adjacent products summed, int32. Interleave{Low,High}: within each 128 bits. PackRound: the inverse order,
// (a + 2^14) >> 15. MergeRound: even lanes from `even`, odd ones from `odd`, rounded likewise.
// Bits: one or more bits a lane of a comparison; a set bit b belongs to lane b >> kLaneShift.
#if defined(__AVX512BW__)

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

#elif defined(__AVX2__)

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

#else

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
  return __builtin_convertvector(__builtin_shufflevector(Round15(low), Round15(high), 0, 1, 2, 3, 4, 5, 6, 7), I16);
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

#endif

}  // namespace
}  // namespace veduta
