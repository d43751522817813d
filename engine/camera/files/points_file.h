// SPDX-License-Identifier: Apache-2.0
#pragma once
// points.json: what a detector of any target saw, for `veduta calibrate --points`.
// docs/calibration.md describes it.

#include <cstddef>
#include <string_view>

#include "engine/camera/calibration/observations.h"
#include "storage/base/status.h"

namespace veduta {

// Limits of one file, so that no file keeps a calibration busy for minutes; chosen by hand, not
// measured.
inline constexpr size_t kPointsFileBytesMax = 32 << 20;
inline constexpr size_t kViewsMax = 300;
inline constexpr size_t kDistinctPointsMax = 3000;

// Reads
//   {"width": W, "height": H,
//    "views": [{"name": "..", "points": [{"id": 0, "x": 1.0, "y": 2.0, "sigma": 0.1}]}]}
// A point without a sigma gets 1. A view may have a width and a height of its own. Members with
// other names are ignored. kInvalidArgument names the view, the point and what is wrong with it.
// Safe on any bytes; thread-safe.
Result<CalibrationInput> ParsePoints(std::string_view text);

}  // namespace veduta
