// SPDX-License-Identifier: Apache-2.0
// Built with -mavx512vl and -mavx512vnni. vpdpbusd multiplies unsigned (the centre) by signed
// (descriptor - 128) bytes and adds four products to 32 bits without saturation. Vectors are 256
// bits wide: for so few centers they are as fast as 512 bits, which would have to be folded first.
#include "index/center_kernels.h"

#if defined(__AVX512VNNI__) && defined(__AVX512VL__)
#include "index/center_lanes.h"

namespace veduta {
namespace {

constexpr int kParts = kCenterSize / 32;

inline __m256i Load(const uint8_t* bytes) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(bytes));
}

inline uint32_t Nearest(const uint8_t* descriptor, const uint8_t* centers, const int32_t* biases,
                        uint32_t count, int32_t* score) {
  __m256i d[kParts];  // x ^ 0x80 as signed is x - 128
  for (int p = 0; p < kParts; ++p)
    d[p] = _mm256_xor_si256(Load(descriptor + 32 * p), _mm256_set1_epi8(-128));
  Lanes lanes;
  for (uint32_t i = 0; i < count; i += 4) {
    __m256i sums[4];
    for (uint32_t r = 0; r < 4; ++r) {
      const uint8_t* row = centers + (i + r < count ? i + r : i) * kCenterSize;
      sums[r] = _mm256_setzero_si256();
      for (int p = 0; p < kParts; ++p)
        sums[r] = _mm256_dpbusd_epi32(sums[r], Load(row + 32 * p), d[p]);
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

const CenterKernels* const kCenterKernelsAvx512Vnni = &kKernels;

}  // namespace veduta
#else
namespace veduta {
const CenterKernels* const kCenterKernelsAvx512Vnni = nullptr;
}
#endif
