// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which of a node's centres is nearest to a descriptor: the inner loop of quantising and of
// k-means.
//
// For a descriptor d and a centre c, both of 128 bytes, the score is |d - c|^2 - |d|^2 = |c|^2 - 2
// c.d, which the same centre minimises as the distance. The kernels compute it as
//     score = bias(c) - 2 sum c_j (d_j - 128),   bias(c) = |c|^2 - 256 sum c_j,
// so that one factor is signed, as VNNI's dot product wants it. All of it is integer and exact:
// |score| < 2^25, and the kernels of every isa (storage/base/cpu_isa.h) give the same bits. This
// header stays free of Eigen and of the standard library's templates, because files that are built
// with wider vectors include it.

#include <cstddef>
#include <cstdint>

namespace veduta {

inline constexpr int kCenterSize = 128;     // bytes of a center and of a descriptor
inline constexpr int kCenterCountMax = 64;  // centers of one node

enum class CpuIsa : uint8_t;  // storage/base/cpu_isa.h

struct CenterKernels {
  // The lowest index among the centres of least score; the score itself goes to *score.
  // centers [count x 128] row-major, biases [count] as CenterBias gives them, count in [1, 64].
  uint32_t (*nearest)(const uint8_t* descriptor, const uint8_t* centers, const int32_t* biases,
                      uint32_t count, int32_t* score);
  // The same for n descriptors [n x 128]: nearest[n], scores[n].
  void (*nearest_each)(const uint8_t* descriptors, size_t n, const uint8_t* centers,
                       const int32_t* biases, uint32_t count, uint8_t* nearest, int32_t* scores);
  // sums[nearest[i]][j] += descriptors[i][j]; sums is [count x 128] row-major. At most 2^24
  // descriptors may go into one sum.
  void (*accumulate)(const uint8_t* descriptors, size_t n, const uint8_t* nearest, uint32_t* sums);
};

// The kernels written for exactly this isa; null where there are none, or the processor lacks it.
const CenterKernels* FindCenterKernels(CpuIsa isa);
// The fastest that this processor can run. Thread-safe.
const CenterKernels& BestCenterKernels();

int32_t CenterBias(const uint8_t* center);
// |d|^2, in [0, 128 * 255^2].
int32_t DescriptorNorm(const uint8_t* descriptor);

// Each is defined in its own file; the vector ones are null off x86-64.
extern const CenterKernels* const kCenterKernelsPortable;
extern const CenterKernels* const kCenterKernelsAvx2;
extern const CenterKernels* const kCenterKernelsAvx512Vnni;

}  // namespace veduta
