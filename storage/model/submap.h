// SPDX-License-Identifier: Apache-2.0
#pragma once
// A part of a large reconstruction that is adjusted by itself.

#include <cstdint>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

// Images of one reconstruction that see much of the same. Either a reconstruction has no submaps,
// or each of its images is in one of them.
struct SubmapRecord {
  SubmapId id;
  ReconstructionId reconstruction;
  std::vector<ImageId> images;  // ascending; at least one
  // How many of them there were when it was last adjusted; 0: its adjustment is due.
  uint32_t images_at_adjustment = 0;
};

}  // namespace veduta
