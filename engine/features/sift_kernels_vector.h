// SPDX-License-Identifier: Apache-2.0
#pragma once
// Vectors of 16-bit integers as wide as the flags of the including source allow, with the few
// operations that the kernels need. Everything is in an unnamed namespace, so that each including
// source has its own.
//
// MulAdd             multiplies lanes and adds adjacent products, as int32.
// InterleaveLow/High take lanes from a and b in turn, within each 128 bits.
// PackRound          undoes the interleaving: (a + 2^14) >> 15 of each int32, as int16.
// MergeRound         even lanes from `even`, odd ones from `odd`, each (a + 2^14) >> 15.
// Bits               a comparison as bits, one or two for each lane: bit b is of lane
//                    b >> kLaneShift.

#if defined(__AVX512BW__)
#include "engine/features/sift_kernels_vector_avx512.h"
#elif defined(__AVX2__)
#include "engine/features/sift_kernels_vector_avx2.h"
#else
#include "engine/features/sift_kernels_vector_portable.h"
#endif
