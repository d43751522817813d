// SPDX-License-Identifier: Apache-2.0
#pragma once
// A hash of structured content.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstring>
#include <string>
#include <type_traits>

#include "storage/base/content_hash.h"
#include "storage/base/ids.h"
#include "storage/base/transform.h"

namespace veduta {

// Feeds numbers as little-endian bytes and texts with their lengths, so that no two contents read
// the same.
class ContentFeed {
 public:
  template <typename T>
  ContentFeed& operator<<(T value) requires std::is_arithmetic_v<T> || std::is_enum_v<T> {
    uint8_t bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    hasher_.Add(bytes);
    return *this;
  }
  template <typename Tag, typename Integer>
  ContentFeed& operator<<(StrongId<Tag, Integer> id) {
    return *this << id.value;
  }
  ContentFeed& operator<<(PointId id) { return *this << id.home << id.ordinal; }
  ContentFeed& operator<<(const std::string& text) {
    *this << static_cast<uint64_t>(text.size());
    hasher_.Add(text);
    return *this;
  }
  ContentFeed& operator<<(const ContentHash& hash) {
    hasher_.Add(hash.bytes);
    return *this;
  }
  ContentFeed& operator<<(const Eigen::Vector3d& v) { return *this << v.x() << v.y() << v.z(); }
  ContentFeed& operator<<(const Eigen::Quaterniond& q) {
    return *this << q.w() << q.x() << q.y() << q.z();
  }
  ContentFeed& operator<<(const Rigid3& pose) { return *this << pose.rotation << pose.translation; }

  ContentHash Finish() { return hasher_.Finish(); }

 private:
  ContentHasher hasher_;
};

}  // namespace veduta
