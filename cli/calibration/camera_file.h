// SPDX-License-Identifier: Apache-2.0
#pragma once
// camera.json, what `veduta calibrate` writes, and the files of other programs that `veduta camera
// add --from` takes. docs/calibration.md describes the format.

#include <optional>
#include <string>
#include <vector>

#include "engine/camera/calibration/calibrator.h"
#include "storage/base/status.h"

namespace veduta {

inline constexpr int kCameraFileVersion = 1;

// The text of a camera.json; `from` says in words what was calibrated from.
std::string CameraFileText(const Calibration& calibration, const std::string& from);

struct CameraFromFile {
  CameraModel model;   // CheckCamera accepts it
  std::string source;  // for the database: where it came from, in words
  std::vector<std::string>
      messages;  // for the user: residuals of a conversion, warnings of a calibration
};

// Reads camera.json, COLMAP's cameras.txt or OpenCV's FileStorage, whichever it is. `colmap_id`
// chooses among several cameras of COLMAP's. kInvalidArgument says what is wrong, or which ids
// there are to choose from; kIoError.
Result<CameraFromFile> ReadCameraFile(const std::string& path, std::optional<uint32_t> colmap_id);

// The same from the file's text.
Result<CameraFromFile> ParseCameraFile(const std::string& text, std::optional<uint32_t> colmap_id);

}  // namespace veduta
