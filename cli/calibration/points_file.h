// SPDX-License-Identifier: Apache-2.0
#pragma once
// points.json: what a detector of any target saw, for `veduta calibrate --points`.
// docs/calibration.md describes it.

#include <string>
#include <string_view>

#include "engine/camera/calibration/observations.h"
#include "storage/base/status.h"

namespace veduta {

inline constexpr size_t kJsonFileBytesMax = 32 << 20;
inline constexpr size_t kViewsMax = 300,
                        kDistinctPointsMax = 3000;  // what an adjustment takes in seconds

// The whole of a file of at most `size_bytes_max`. kIoError, kInvalidArgument if it is larger.
Result<std::string> ReadWholeFile(const std::string& path, size_t size_bytes_max);

// {"width": W, "height": H, "views": [{"name": "..", "points": [{"id": 0, "x": 1.0, "y": 2.0,
// "sigma": 0.1}]}]} sigma may be left out everywhere (then 1); a view may have a width and height
// of its own. Other members are ignored. kInvalidArgument names the view, the point and the fault.
// Safe on any bytes.
Result<CalibrationInput> ParsePoints(std::string_view text);

}  // namespace veduta
