// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which instruction set the matcher's kernels use. All of them give the same bits.

#include <cstdint>

#include "engine/matching/matcher_kernels.h"

namespace veduta {

// In ascending order of speed; each machine has those up to its best.
enum class MatcherIsa : uint8_t { kPortable = 0, kAvx2 = 1, kAvx512Vnni = 2 };

// The fastest that this processor, its operating system and this build have. Thread-safe.
MatcherIsa BestMatcherIsa();

const char* MatcherIsaName(MatcherIsa isa);

// The kernels of `isa`, or of the best there is where this machine lacks it.
const MatcherKernels& MatcherKernelsFor(MatcherIsa isa);

}  // namespace veduta
