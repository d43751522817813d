// SPDX-License-Identifier: Apache-2.0
#pragma once
// What goes through the door of photos that the map has another way round than their files.

#include <cstdint>
#include <string>

#include "engine/door/questions.h"
#include "storage/base/status.h"

namespace veduta {

struct TurnedPhotos {
  uint64_t count = 0;
  std::string first;  // the name of that with the lowest number; empty where there is none
};

// Photos with poses whose files say (EXIF) that their pixels must be turned, and whose cameras and
// poses are of the turned pixels. Programs that take the pixels of a file as they are, as COLMAP
// does, cannot use these beside the files. Reads the bytes of each photo that stands upright, one
// at a time; one that cannot be read is passed over.
Result<TurnedPhotos> FindTurnedPhotos(const Questions& ask);

}  // namespace veduta
