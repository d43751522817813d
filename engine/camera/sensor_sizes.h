// SPDX-License-Identifier: Apache-2.0
#pragma once
// How large the sensors of cameras are that tell their focal length, and nothing that it could be
// compared with: neither the 35 mm equivalent nor the sensor's resolution.

#include <optional>
#include <string_view>

namespace veduta {

struct SensorSize {
  double width_mm, height_mm;  // the longer side first

  bool operator==(const SensorSize&) const = default;
};

// By the names that the camera writes into a photo (ExifCamera): whether letters are large or small
// says nothing, nor does the maker's name in front of the model. Nothing for a camera that the
// table lacks. Some microseconds; thread-safe.
std::optional<SensorSize> FindSensorSize(std::string_view make, std::string_view model);

}  // namespace veduta
