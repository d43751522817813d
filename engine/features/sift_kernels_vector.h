// SPDX-License-Identifier: Apache-2.0
#pragma once
// Vectors of 16-bit integers as wide as the flags of the including source allow, with the few
// operations the kernels need. Everything is in an unnamed namespace: each including source has its
// own.
//
// MulAdd: adjacent products summed, int32. Interleave{Low,High}: within each 128 bits. PackRound:
// the inverse order, (a + 2^14) >> 15. MergeRound: even lanes from `even`, odd ones from `odd`,
// rounded likewise. Bits: one or more bits a lane of a comparison; a set bit b belongs to lane b >>
// kLaneShift.

#if defined(__AVX512BW__)
#include "engine/features/sift_kernels_vector_avx512.h"
#elif defined(__AVX2__)
#include "engine/features/sift_kernels_vector_avx2.h"
#else
#include "engine/features/sift_kernels_vector_portable.h"
#endif
