// SPDX-License-Identifier: Apache-2.0
#pragma once
// The functions of the door that calibrate cameras and read and write them. None of them needs a
// database. engine/door/calibration.h holds what they take and return.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "engine/door/calibration.h"

namespace veduta {

// Calibrates a camera from photos of printed markers, or from the points of a points.json.
//
// The answer's messages are in the order in which the work is done: notes on single photos, each
// beginning with the photo's name; then notes and warnings on the calibration. kInvalidArgument if
// the request's Check refuses it, or if nothing useful can be told: the message says what to
// photograph, and ends with the notes on single photos. kIoError if the points file cannot be read.
// Deterministic in the files and the request, whatever the number of threads. Thread-safe.
Result<CalibrationAnswer> Calibrate(const CalibrateRequest& request);

// Sheets of markers to print, six to a sheet, as one PDF: markers 0 to count - 1. `paper` is "a4"
// or "letter"; `count` lies in [1, 178]. kInvalidArgument otherwise. The same bytes for the same
// arguments.
Result<MarkerSheets> MakeMarkerSheets(std::string_view paper, uint32_t count);

// Reads a camera from the file at `path`: a camera.json, COLMAP's cameras.txt, or a file of
// OpenCV's FileStorage. `colmap_id` chooses among several cameras of a cameras.txt.
// kInvalidArgument says what is wrong, or which ids there are to choose from; kIoError if the file
// cannot be read. Both name the path.
Result<CameraFromFile> ReadCameraFile(const std::string& path, std::optional<uint32_t> colmap_id);

// A camera as people type it: a size "WIDTHxHEIGHT" in px, and "fx,fy,cx,cy[,k1,k2[,u0,v0]]", with
// the units of CameraModel. kInvalidArgument names what is wrong.
Result<CameraModel> ParseCamera(std::string_view size, std::string_view params);

// The shortest texts that ParseCamera reads back as the same model.
std::string CameraSizeText(const CameraModel& model);
std::string CameraParamsText(const CameraModel& model);

}  // namespace veduta
