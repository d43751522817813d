// SPDX-License-Identifier: Apache-2.0
#include "kernels/total_variation_kernels.h"

#if defined(__AVX512BW__)
// The kernels, with the vectors that CMakeLists.txt asks for in this file.
#include "kernels/total_variation_kernels.inc"

namespace veduta {
const TvKernels* const kTvKernelsAvx512 = &kKernels;
}  // namespace veduta
#else
namespace veduta {
const TvKernels* const kTvKernelsAvx512 = nullptr;
}  // namespace veduta
#endif
