// SPDX-License-Identifier: Apache-2.0
#pragma once
// The greatest memory of this process since a moment, by Linux's own count.

namespace veduta::bench {

void ResetMemoryPeak();
// MB (10^6 bytes) that the process has at most held since the reset; 0 where Linux does not say.
double MemoryPeakMb();
// MB that it holds now.
double MemoryNowMb();

}  // namespace veduta::bench
