// SPDX-License-Identifier: Apache-2.0
#pragma once
// Embree asks for denormals as zero in every thread that traces rays. Put one at the head of each
// task.

#if defined(__SSE__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

namespace veduta {

class DenormalsOff final {
 public:
#if defined(__SSE__)
  DenormalsOff() : saved_(_mm_getcsr()) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  }
  ~DenormalsOff() {
    _mm_setcsr(saved_);
  }
#else
  DenormalsOff() = default;
#endif
  DenormalsOff(const DenormalsOff&) = delete;
  DenormalsOff& operator=(const DenormalsOff&) = delete;

 private:
  [[maybe_unused]] unsigned saved_ = 0;
};

}  // namespace veduta
