// SPDX-License-Identifier: Apache-2.0
#pragma once
// This program's own `operator new`, which can refuse large pieces on one thread. To be included by
// one source of a program. RocksDB does not bear a refusal: what a test reads of it meanwhile must
// be smaller than the limit.

#include <cstdlib>
#include <limits>
#include <new>

namespace veduta {

inline thread_local size_t piece_size_bytes_max = std::numeric_limits<size_t>::max();

// While it lives, larger pieces are refused to the thread that made it.
class MemoryLimit final {
 public:
  explicit MemoryLimit(size_t size_bytes_max) { piece_size_bytes_max = size_bytes_max; }
  ~MemoryLimit() { piece_size_bytes_max = std::numeric_limits<size_t>::max(); }
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;
};

}  // namespace veduta

// Not inlined: g++ 12 would warn that `free` frees what `new` gave.
[[gnu::noinline]] void* operator new(size_t size, const std::nothrow_t&) noexcept {
  return size > veduta::piece_size_bytes_max ? nullptr : std::malloc(size);
}
[[gnu::noinline]] void* operator new(size_t size) {
  void* const piece = operator new(size, std::nothrow);
  if (piece == nullptr) throw std::bad_alloc();
  return piece;
}
[[gnu::noinline]] void operator delete(void* piece) noexcept {
  std::free(piece);
}
[[gnu::noinline]] void operator delete(void* piece, size_t) noexcept {
  std::free(piece);
}
