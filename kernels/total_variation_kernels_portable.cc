// SPDX-License-Identifier: Apache-2.0
#include "kernels/total_variation_kernels.inc"

namespace veduta {
const TvKernels* const kTvKernelsPortable = &kKernels;
}  // namespace veduta
