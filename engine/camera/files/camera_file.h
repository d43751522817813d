// SPDX-License-Identifier: Apache-2.0
#pragma once
// camera.json, what `veduta calibrate` writes, and the files of other programs that `veduta camera
// add --from` takes. docs/calibration.md describes the format.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "engine/camera/calibration/calibrator.h"
#include "engine/door/calibration.h"
#include "storage/base/status.h"

namespace veduta {

// The largest camera file that is read, in bytes; chosen by hand, not measured.
inline constexpr size_t kCameraFileBytesMax = 16 << 20;

// The text of a camera.json. `from` says in words what was calibrated from.
std::string CameraFileText(const Calibration& calibration, const std::string& from);

// Reads the text of a camera.json, of COLMAP's cameras.txt or of a file of OpenCV's FileStorage,
// whichever it is. `colmap_id` chooses among several cameras of COLMAP's. CheckCamera accepts the
// model returned. kInvalidArgument says what is wrong, or which ids there are to choose from. Safe
// on any bytes; thread-safe.
Result<CameraFromFile> ParseCameraFile(const std::string& text, std::optional<uint32_t> colmap_id);

}  // namespace veduta
