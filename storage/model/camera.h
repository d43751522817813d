// SPDX-License-Identifier: Apache-2.0
#pragma once
// A camera with its lens.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "storage/base/ids.h"

namespace veduta {

// Pinhole with the paper's radial distortion about its own center. All in px of the (upright)
// photo; k1 and k2 in normalized coordinates: x_d = c + (x - c)(1 + k1 r^2 + k2 r^4), r = |x - c|,
// c = ((u0 - cx) / fx, (v0 - cy) / fy).
struct CameraModel {
  uint32_t width_px = 0, height_px = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0;
  double u0 = 0, v0 = 0;  // center of distortion; equals (cx, cy) unless said otherwise

  bool operator==(const CameraModel&) const = default;
};

struct AwaitedPhotos;  // storage/model/awaited_photos.h

struct CameraRecord {
  CameraId id;
  std::string name;
  CameraModel model;
  std::string source;  // where the intrinsics came from, in words
  // Whether photos of the city alone have told its lens. It is then refined with what they see;
  // otherwise it stays.
  bool is_refinable = false;
  // Null once these photos were added, and where there never were any.
  std::shared_ptr<const AwaitedPhotos> awaited = {};
  // The focal length over the photo's longer side that its first photo told; 0 where it told none.
  double told_focal_share = 0;
  // Standard deviation of the focal length over itself; 0 where it is not known, and of a camera
  // that a person has named.
  double focal_stddev_share = 0;
  uint32_t version = 1;  // grows each time that its intrinsics change
  // What its photos are straightened by before features are extracted, where it is another model
  // than `model`: that one has been refined since. They differ by fx, fy, k1 and k2 alone. What is
  // stored of a photo's features never changes; where they lie by `model` is told by
  // CarryKeypoints (engine/photo/carried_features.h).
  std::optional<CameraModel> refined_from = {};

  const CameraModel& extraction_model() const { return refined_from ? *refined_from : model; }
};

}  // namespace veduta
