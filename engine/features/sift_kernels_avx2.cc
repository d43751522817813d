// SPDX-License-Identifier: Apache-2.0
#include "engine/features/sift_kernels.h"

#if defined(__AVX2__)
#include "engine/features/sift_kernels_float.h"
#include "engine/features/sift_kernels_vector.h"
// Kernels in terms of the vectors above.
#include "engine/features/sift_kernels.inc"

namespace veduta {
const SiftKernels* const kSiftKernelsAvx2 = &kTable;
}  // namespace veduta
#else
namespace veduta {
const SiftKernels* const kSiftKernelsAvx2 = nullptr;
}  // namespace veduta
#endif
