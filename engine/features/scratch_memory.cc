// SPDX-License-Identifier: Apache-2.0
#include "engine/features/scratch_memory.h"

#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace veduta {
namespace {

constexpr size_t kHugePageBytes = size_t{1} << 21;
constexpr std::align_val_t kAlignment{64}, kHugeAlignment{kHugePageBytes};

std::align_val_t AlignmentOf(size_t count) {
  return count * sizeof(int16_t) >= kHugePageBytes ? kHugeAlignment : kAlignment;
}

}  // namespace

GrayBuffer::~GrayBuffer() {
  if (data_ != nullptr) ::operator delete(data_, AlignmentOf(count_));
}

int16_t* GrayBuffer::Reserve(size_t count) {
  if (count > count_) {
    if (data_ != nullptr) ::operator delete(data_, AlignmentOf(count_));
    data_ = nullptr;
    count_ = 0;
    data_ = static_cast<int16_t*>(::operator new(count * sizeof(int16_t), AlignmentOf(count)));
#if defined(__linux__)
    // A column of a patch touches one small page in each row, and the processor would have to look
    // up most of these addresses. This is only advice: a refusal changes nothing but the time.
    const size_t bytes = count * sizeof(int16_t);
    if (bytes >= kHugePageBytes)
      (void)madvise(data_, bytes / kHugePageBytes * kHugePageBytes, MADV_HUGEPAGE);
#endif
    count_ = count;
  }
  return data_;
}

}  // namespace veduta
