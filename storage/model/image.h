// SPDX-License-Identifier: Apache-2.0
#pragma once
// A stored photo: where it came from and what became of it.

#include <cstdint>
#include <optional>
#include <string>

#include "storage/base/content_hash.h"
#include "storage/base/ids.h"
#include "storage/model/geo.h"
#include "storage/model/taken_time.h"
#include "storage/model/verdict.h"

namespace veduta {

// What a contributor calls a photo: unique among those of the contributor.
struct PhotoName {
  std::string name, contributor;
};

struct ImageRecord {
  ImageId id;
  std::string name;  // unique among the contributor's; the path relative to the folder given
  ContentHash photo;
  CameraId camera;
  uint32_t width_px = 0, height_px = 0;
  uint64_t size_bytes = 0;
  uint32_t feature_count = 0;
  std::string contributor;
  int64_t time_unix_s = 0;  // when it was applied; not part of the digest
  Verdict verdict = Verdict::kRejected;
  Reason reason = Reason::kNone;
  std::string detail;         // the reason with its numbers, for a person
  std::optional<GpsFix> gps;  // what the photo says of where it was taken
  // The next four are not part of the digest: an earlier program left them unset.
  std::optional<TakenTime> taken;  // what the photo says of when it was taken
  std::string media_type;          // of its bytes, "image/jpeg"; empty: not noted
  uint32_t contribution = 0;       // that it came with; 0: with none, or not noted
  // How its pixels, the way round that its camera has them, are turned for the photo to stand
  // upright: EXIF's number of that, 1 to 8. 1: they are upright; 0: not noted.
  uint8_t orientation = 0;
};

}  // namespace veduta
