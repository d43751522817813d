// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that have told their camera before they are stored.

#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {

// As Engine::CalibrateFirst leaves them with each camera: whoever is interrupted while these photos
// are added goes on as it had begun.
struct AwaitedPhotos {
  std::vector<ContentHash> photos;  // that the camera took
  ContentHash list;                 // of the hashes of all that were to be added together
};

}  // namespace veduta
