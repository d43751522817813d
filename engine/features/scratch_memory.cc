// SPDX-License-Identifier: Apache-2.0
#include "engine/features/scratch_memory.h"

#include <new>

namespace veduta {
namespace {
constexpr std::align_val_t kAlignment{64};
}  // namespace

GrayBuffer::~GrayBuffer() {
  if (data_ != nullptr) ::operator delete(data_, kAlignment);
}

int16_t* GrayBuffer::Reserve(size_t count) {
  if (count > count_) {
    if (data_ != nullptr) ::operator delete(data_, kAlignment);
    data_ = nullptr;
    count_ = 0;
    data_ = static_cast<int16_t*>(::operator new(count * sizeof(int16_t), kAlignment));
    count_ = count;
  }
  return data_;
}

}  // namespace veduta
