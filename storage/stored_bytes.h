// SPDX-License-Identifier: Apache-2.0
#pragma once
// A large value of the database, such as a photo.

#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace veduta {

// Owns its bytes: it needs neither the snapshot nor the database that it was read from. They are
// not necessarily aligned. A span of them is valid until the value is moved from or destroyed.
class StoredBytes final {
 public:
  StoredBytes() = default;
  explicit StoredBytes(std::string value) : value_(std::move(value)) {}

  std::span<const uint8_t> bytes() const {
    return {reinterpret_cast<const uint8_t*>(value_.data()), value_.size()};
  }

 private:
  std::string value_;
};

}  // namespace veduta
