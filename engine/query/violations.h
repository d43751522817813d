// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the checks of a database have found.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

// Collects a sentence for each violation, up to a maximum. Not thread-safe.
class Violations final {
 public:
  explicit Violations(size_t count_max) : count_max_(count_max) {}

  bool full() const { return found_.size() >= count_max_; }
  void Add(std::string violation) {
    if (!full()) found_.push_back(std::move(violation));
  }
  // `violation` is a sentence, or a function that makes one: most checks hold, and the text of a
  // check that holds is not wanted.
  template <typename Text>
  void Expect(bool holds, Text&& violation) {
    if (holds || full()) return;
    if constexpr (std::is_invocable_v<Text>) {
      Add(violation());
    } else {
      Add(std::forward<Text>(violation));
    }
  }
  // Damage is a violation, and the checks go on; any other failure, such as a disk that cannot be
  // read, is returned.
  Status Note(const Status& status) {
    if (status.code() != StatusCode::kCorruption && status.code() != StatusCode::kNotFound)
      return status;
    Add(status.message());
    return Status::Ok();
  }
  std::vector<std::string> Take() { return std::move(found_); }

 private:
  const size_t count_max_;
  std::vector<std::string> found_;
};

// What violations call a record.
inline std::string NameOf(ImageId id) {
  return "image " + std::to_string(id.value);
}
inline std::string NameOf(PointId id) {
  return "point " + std::to_string(id.home.value) + "/" + std::to_string(id.ordinal);
}
inline std::string NameOf(ReconstructionId id) {
  return "reconstruction " + std::to_string(id.value);
}
inline std::string NameOf(CameraId id) {
  return "camera " + std::to_string(id.value);
}

}  // namespace veduta
