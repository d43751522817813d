// SPDX-License-Identifier: Apache-2.0
#pragma once
// What goes through the door of a camera.

#include <cstdint>
#include <optional>
#include <string>

#include "storage/base/ids.h"
#include "storage/model/camera.h"

namespace veduta {

struct CameraAnswer {
  CameraId id;
  std::string name;
  CameraModel model;
  std::string source;
  uint32_t version = 1;  // grows each time that its intrinsics are refined; the journal has each
  // Standard deviation of the focal length over itself; nothing where it is not told, and of a
  // camera that a person has named.
  std::optional<double> focal_stddev_share;
};

}  // namespace veduta
