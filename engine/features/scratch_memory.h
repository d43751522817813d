// SPDX-License-Identifier: Apache-2.0
#pragma once
// Memory that is kept from one photo to the next: touching fresh pages for the first time costs
// more than some of the blurs.

#include <cstddef>
#include <cstdint>

namespace veduta {

// 64-byte aligned values, uninitialised; in huge pages when they fill some. Throws std::bad_alloc.
class GrayBuffer final {
 public:
  GrayBuffer() = default;
  ~GrayBuffer();
  GrayBuffer(const GrayBuffer&) = delete;
  GrayBuffer& operator=(const GrayBuffer&) = delete;

  // At least `count` values; the old content is lost when it has to grow.
  int16_t* Reserve(size_t count);
  int16_t* data() const { return data_; }

 private:
  int16_t* data_ = nullptr;
  size_t count_ = 0;
};

}  // namespace veduta
