// SPDX-License-Identifier: Apache-2.0
#include "engine/features/sift_kernels_float.h"
#include "engine/features/sift_kernels_vector.h"
// Kernels in terms of the vectors above.
#include "engine/features/sift_kernels.inc"

namespace veduta {
const SiftKernels* const kSiftKernelsPortable = &kTable;
}  // namespace veduta
