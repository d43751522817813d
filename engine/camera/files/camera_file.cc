// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/files/camera_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "engine/camera/calibration/known_camera.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kIdsListedMax = 10;  // cameras of a cameras.txt that a message lists

std::string Rounded(double value, int digits) {
  std::array<char, 48> text;
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

Status Wrong(const std::string& what) {
  return Status::InvalidArgument("camera file: " + what);
}

Result<CameraFromFile> FromCalibration(const Json& file) {
  if (!file.is_object() || file.value("format", "") != kCameraFileFormat) {
    return Wrong("JSON, but neither what `veduta calibrate` writes nor what OpenCV does");
  }
  if (!file.contains("version") || file["version"] != kCameraFileVersion) {
    return Wrong("its version is not " + std::to_string(kCameraFileVersion) +
                 "; a newer veduta wrote it");
  }
  CameraFromFile read;
  std::array<double, 8> values{};
  for (size_t i = 0; i < values.size(); ++i)
    values[i] = file.at("intrinsics").at(kIntrinsicNames[i]).get<double>();
  read.model.width_px = file.at("width").get<uint32_t>();
  read.model.height_px = file.at("height").get<uint32_t>();
  read.model = WithIntrinsics(read.model, values);
  VEDUTA_RETURN_IF_ERROR(CheckCamera(read.model));
  const Json& how = file.at("calibration");
  read.source =
      "calibrated from " + how.at("from").get<std::string>() + ": " +
      std::to_string(how.at("photos_used").get<uint32_t>()) + " photos, mean reprojection error " +
      Rounded(how.at("error_px_mean").get<double>(), 3) + " px, f known to " +
      Rounded(100 * file.at("standard_deviations").at("fx").get<double>() / read.model.fx, 3) +
      " %";
  for (const Json& warning : how.at("warnings"))
    read.messages.push_back("warning: " + warning.get<std::string>());
  return read;
}

Result<CameraFromFile> FromKnown(const KnownCamera& known, const std::string& from) {
  VEDUTA_ASSIGN_OR_RETURN(const ConvertedCamera converted, ConvertCamera(known));
  CameraFromFile read;
  read.model = converted.model;
  const std::string residual = "off by " + Rounded(converted.residual.mean_px, 3) +
                               " px in the mean and " + Rounded(converted.residual.largest_px, 3) +
                               " px at most";
  read.source = "imported from " + from + ", " + residual;
  read.messages.push_back("converted from " + from + ": " + residual + " over the photo");
  if (converted.residual.largest_px > kResidualGoodPx) {
    read.messages.push_back(
        "warning: k1, k2 and a centre of distortion do not express this lens well; `veduta "
        "calibrate`"
        " with photos of the camera would");
  }
  return read;
}

Result<CameraFromFile> FromColmap(const std::string& text, std::optional<uint32_t> id) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<KnownColmapCamera> cameras, ParseColmapCameras(text));
  if (!id && cameras.size() > 1) {
    std::string ids;
    for (size_t i = 0; i < std::min(cameras.size(), kIdsListedMax); ++i) {
      ids += (i ? ", " : "") + std::to_string(cameras[i].id);
    }
    return Wrong("it has " + std::to_string(cameras.size()) + " cameras; choose one by --id: " +
                 ids + (cameras.size() > kIdsListedMax ? ", ..." : ""));
  }
  const auto chosen =
      std::find_if(cameras.begin(), cameras.end(),
                   [&](const KnownColmapCamera& camera) { return !id || camera.id == *id; });
  if (chosen == cameras.end()) return Wrong("there is no camera " + std::to_string(*id) + " in it");
  return FromKnown(chosen->camera, "COLMAP's " + chosen->model);
}

// Decides by the first line that is neither empty nor a comment: COLMAP's begins with a camera's
// number, while OpenCV's FileStorage begins with < in XML and with % in YAML. COLMAP's own first
// comment decides too.
bool LooksLikeColmap(const std::string& text) {
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    const size_t first = text.find_first_not_of(" \t\r", at);
    if (first < end && text[first] != '#') return text[first] >= '0' && text[first] <= '9';
    if (first < end && text.compare(first, 8, "# Camera") == 0) return true;
    at = end + 1;
  }
  return false;
}

}  // namespace

std::string CameraFileText(const Calibration& c, const std::string& from) {
  Json intrinsics, sigmas;
  const std::array<double, 8> values = IntrinsicsOf(c.model);
  for (size_t i = 0; i < values.size(); ++i) {
    intrinsics[kIntrinsicNames[i]] = values[i];
    sigmas[kIntrinsicNames[i]] = c.Sigma(static_cast<int>(i));
  }
  Json warnings = Json::array(), notes = Json::array(), photos = Json::array();
  for (const CalibrationWarning& w : c.warnings) (w.IsNote() ? notes : warnings).push_back(w.text);
  for (const CalibrationPhoto& photo : c.photos) {
    photos.push_back(
        {{"name", photo.name},
         {"points", photo.used_count},
         {"points_left_out", photo.left_out_count},
         {"error_px_rms", photo.why_left_out.empty() ? Json(photo.error_px_rms) : Json(nullptr)},
         {"left_out", photo.why_left_out}});
  }
  const Json file = {{"format", kCameraFileFormat},
                     {"version", kCameraFileVersion},
                     {"width", c.model.width_px},
                     {"height", c.model.height_px},
                     {"intrinsics", intrinsics},
                     {"standard_deviations", sigmas},
                     {"calibration",
                      {{"from", from},
                       {"status", c.status == CalibrationStatus::kGood ? "good" : "uncertain"},
                       {"photos_used", c.UsedPhotoCount()},
                       {"error_px_mean", c.error_px_mean},
                       {"error_px_rms", c.error_px_rms},
                       {"distortion_sigma_px", c.distortion_sigma_px},
                       {"square_pixels", !c.is_aspect_free},
                       {"warnings", warnings},
                       {"notes", notes},
                       {"photos", photos}}}};
  return file.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<CameraFromFile> ParseCameraFile(const std::string& text, std::optional<uint32_t> colmap_id) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) return Wrong("it is empty");
  if (LooksLikeColmap(text)) return FromColmap(text, colmap_id);
  if (colmap_id)
    return Wrong("--id chooses among the cameras of COLMAP's cameras.txt, which this is not");
  if (text[text.find_first_not_of(" \t\r\n")] == '{' &&
      text.find(kCameraFileFormat) != std::string::npos) {
    try {
      return FromCalibration(Json::parse(text));
    } catch (const nlohmann::json::exception& error) {
      return Wrong(std::string("it is damaged: ") + error.what());
    }
  }
  VEDUTA_ASSIGN_OR_RETURN(const KnownCamera known, ParseOpenCvCamera(text));
  return FromKnown(known, "OpenCV's calibration");
}

}  // namespace veduta
