// SPDX-License-Identifier: Apache-2.0
#pragma once
// Stored photos: their bytes, and finding them by when and where they were taken.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/door/earth.h"
#include "storage/base/ids.h"
#include "storage/model/geo.h"
#include "storage/model/taken_time.h"
#include "storage/model/verdict.h"

namespace veduta {

struct PhotoFile {
  std::string media_type;  // "image/jpeg"
  std::vector<uint8_t> bytes;
};

inline constexpr uint32_t kThumbnailSideMax = 4096;  // px; chosen by hand

// Photos that one search looks at, at most. Chosen by hand: as many as an answer in a tenth of a
// second allows.
inline constexpr uint32_t kSearchedPhotosMax = 20'000;

struct PhotoSearch {
  ImageId after;                // only greater ids; not valid(): all
  uint32_t count_max = 10;      // >= 1, of photos that are found
  std::vector<ImageId> images;  // only these; empty: any
  // That may have been taken in between, both included; seconds since 1970.
  std::optional<int64_t> taken_from_unix_s, taken_to_unix_s;
  // That were taken where this says so; empty: anywhere. Photos of which nothing tells the place
  // are not asked about, and not found then.
  std::function<bool(const GeoPosition&)> is_there;
};

struct FoundPhoto {
  ImageId id;
  std::string name, contributor;
  Verdict verdict = Verdict::kPostponed;
  std::string sha256;      // of its bytes, in hexadecimal
  std::string media_type;  // "image/jpeg"; empty where an earlier program stored it
  uint32_t width_px = 0, height_px = 0;
  uint64_t size_bytes = 0;
  int64_t stored_unix_s = 0;
  // It was taken between these, both included: they are the same where that is known exactly, 26
  // hours apart where it says what the camera's clock showed and not in which zone, and otherwise
  // the year 1826 and the moment when it was stored.
  int64_t taken_from_unix_s = 0, taken_to_unix_s = 0;
  std::optional<TakenTime> taken;   // what it says itself
  uint32_t contribution = 0;        // that it came with; 0: with none, or not noted
  std::string licence;              // of that; may be empty
  bool is_hidden = false;           // ImageAnswer::is_hidden
  ReconstructionId reconstruction;  // valid where it has a pose
  // By its pose, where that is sure and its reconstruction has a place on the earth.
  std::optional<EarthPose> on_earth;
  std::optional<GpsFix> gps;  // what it says itself of where it was taken
};

struct FoundPhotos {
  uint64_t snapshot = 0;
  std::vector<FoundPhoto> photos;  // ascending ids
  // To go on after, where there may be more; not valid() at the end. Photos that come meanwhile
  // have greater ids, so that nobody who goes on is told of one twice, or misses one.
  ImageId next_after;
};

// Between which all photos lie; nothing where nothing is known.
struct PhotoExtent {
  std::optional<GeoPosition> south_west, north_east;
  std::optional<int64_t> taken_from_unix_s, taken_to_unix_s;
};

}  // namespace veduta
