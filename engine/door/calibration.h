// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras, as the door offers them: calibration by printed markers or by photos of any place,
// sheets to print, camera files and the text of cameras. Nothing here needs a database, but for the
// cameras that one holds. Standard library and plain structs only.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/model/camera.h"

namespace veduta {

// A camera of the city.
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

struct CalibrateRequest {
  std::vector<std::string> photo_paths;  // photos of markers, or of a scene; or
  std::string points_path;               // a points.json of any flat target (docs/calibration.md)
  // The photos show any place instead of markers: not as exact, but nothing has to be printed.
  bool is_scene = false;
  uint32_t marker_count = 96;  // how many different markers were printed
  uint32_t thread_count = 1;   // [1, 256]; photos looked at side by side

  Status Check() const;  // the first violated bound, named with its value
};

struct CalibrationMessage {
  bool is_warning = false;   // else a note
  bool is_of_photo = false;  // on one photo by itself, with whose name it begins
  std::string text;          // a sentence or two: what is wrong, what to photograph next
};

// What became of one photo of a calibration.
struct CalibratedPhoto {
  std::string name;
  uint32_t points = 0, points_left_out = 0;
  double error_px_rms = 0;   // of the points that were used
  std::string why_left_out;  // empty for a photo that was used
};

// What a camera.json calls itself.
inline constexpr const char* kCameraFileFormat = "veduta camera";
inline constexpr int kCameraFileVersion = 1;

struct CalibrationAnswer {
  std::string from;  // what the camera was calibrated from, in words
  CameraModel model;
  bool is_good = false;  // false: uncertain, and a warning says why
  // Of fx, fy, cx, cy, k1, k2, u0, v0: what they are called, their values, standard deviations.
  std::array<std::string, 8> intrinsic_names;
  std::array<double, 8> intrinsics{}, sigmas{};
  double error_px_mean = 0, error_px_rms = 0;
  double distortion_sigma_px = 0;  // largest over the photo
  bool has_square_pixels = false;  // the photos do not prove that fy differs from fx
  uint32_t photos_used = 0, photos = 0;
  std::vector<CalibratedPhoto> calibrated_photos;
  std::vector<CalibrationMessage> messages;
  std::string camera_file;  // the text of a camera.json, which ReadCameraFile reads
  std::string report_html;  // one page that needs nothing else
};

struct MarkerSheets {
  uint32_t sheet_count = 0;
  std::vector<uint8_t> pdf;
};

struct CameraFromFile {
  CameraModel model;
  std::string source;                 // for the database: where it came from, in words
  std::vector<std::string> messages;  // for the user: residuals of a conversion, warnings
};

// The functions are deterministic and thread-safe.
// Calibrates a camera from photos of printed markers or of any place, or from a points.json. The
// messages are in the order of the work: notes on single photos, which begin with the photo's name,
// then those on all. kInvalidArgument, with what to photograph, if nothing useful can be told.
Result<CalibrationAnswer> Calibrate(const CalibrateRequest& request);

// Sheets of markers to print, six to a sheet, as one PDF. `paper` is "a4" or "letter"; `count` lies
// in [1, kMarkerCountMax].
inline constexpr uint32_t kMarkerCountMax = 178;
Result<MarkerSheets> MakeMarkerSheets(std::string_view paper, uint32_t count);

// Reads a camera.json, COLMAP's cameras.txt (`colmap_id` chooses among several) or a file of
// OpenCV's FileStorage. kInvalidArgument says what is wrong, or which ids there are; kIoError.
Result<CameraFromFile> ReadCameraFile(const std::string& path, std::optional<uint32_t> colmap_id);

// A camera as people type it: a size "WIDTHxHEIGHT" in px, and "fx,fy,cx,cy[,k1,k2[,u0,v0]]", with
// the units of CameraModel. kInvalidArgument names what is wrong.
Result<CameraModel> ParseCamera(std::string_view size, std::string_view params);
// The shortest texts that ParseCamera reads back as the same model.
std::string CameraSizeText(const CameraModel& model);
std::string CameraParamsText(const CameraModel& model);

}  // namespace veduta
