// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a person says must not be, whatever the pictures seem to tell.

#include <cstdint>
#include <string>

namespace veduta {

// Values are stored: append only, never renumber.
enum class ForbiddenKind : uint8_t {
  kPair = 1,   // these two images do not show the same place: they are never a verified pair
  kMerge = 2,  // these two reconstructions are never merged
  kPose = 3,   // this image has no pose
};

struct ForbiddenRecord {
  ForbiddenKind kind = ForbiddenKind::kPair;
  // Ids of two images or two reconstructions, a < b; of kPose both are the one image's.
  uint32_t a = 0, b = 0;
  int64_t time_unix_s = 0;
  std::string actor;   // who says so
  std::string reason;  // for people
};

}  // namespace veduta
