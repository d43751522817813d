// SPDX-License-Identifier: Apache-2.0
#pragma once
// Memory that two processes see, by a descriptor that one hands to the other. Nothing of it has a
// name or lies in a folder.

#include <cstdint>
#include <span>
#include <utility>

#include "storage/base/status.h"

namespace veduta {

// A descriptor that is closed at its end.
class Descriptor final {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();
  int number() const { return number_; }

 private:
  int number_;
};

// Memory with these bytes, which nobody can change any more. kIoError.
Result<Descriptor> ShareForReading(std::span<const uint8_t> bytes);
// Memory of zeros, which whoever has the descriptor may write, and nobody can resize: a reader
// never finds that a part of it has gone. kIoError.
Result<Descriptor> ShareForWriting(uint64_t size_bytes);

// The memory behind a descriptor, as long as this lives.
class MappedMemory final {
 public:
  enum class Access : uint8_t { kRead, kWrite };
  // All of it is fetched at once. kIoError where it is not of this size (> 0), or cannot be mapped.
  static Result<MappedMemory> Map(int descriptor, uint64_t size_bytes, Access access);
  MappedMemory(MappedMemory&& other) noexcept
      : start_(std::exchange(other.start_, nullptr)), size_bytes_(other.size_bytes_) {}
  MappedMemory& operator=(MappedMemory&&) = delete;
  ~MappedMemory();

  uint8_t* data() const { return start_; }
  uint64_t size_bytes() const { return size_bytes_; }

 private:
  MappedMemory(uint8_t* start, uint64_t size_bytes) : start_(start), size_bytes_(size_bytes) {}

  uint8_t* start_;
  uint64_t size_bytes_;
};

}  // namespace veduta
