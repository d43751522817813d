// SPDX-License-Identifier: Apache-2.0
// The files of COLMAP and OpenCV.
#include <charconv>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "engine/camera/calibration/known_camera.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

constexpr size_t kCamerasMax = 100'000;  // in one cameras.txt; chosen by hand

std::vector<std::string_view> Words(std::string_view line) {
  std::vector<std::string_view> words;
  for (size_t at = 0;;) {
    at = line.find_first_not_of(" \t\r", at);
    if (at == std::string_view::npos) return words;
    const size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
}

template <typename Number>
bool Parse(std::string_view word, Number* number) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *number);
  return error == std::errc() && end == word.data() + word.size();
}

bool IsSide(double side) {
  return side >= 1 && side <= kCameraSideMax && side == std::floor(side);
}

// Puts the parameters of one of COLMAP's models to their places.
void SetParameters(const std::string& model, const std::vector<double>& p, KnownCamera* camera) {
  const bool is_pinhole = model == "PINHOLE" || model == "OPENCV";
  const size_t first = is_pinhole ? 4 : 3;  // of the distortion
  camera->fx = p[0];
  camera->fy = p[is_pinhole ? 1 : 0];
  camera->cx = p[first - 2] - 0.5;
  camera->cy = p[first - 1] - 0.5;
  camera->coefficients.assign(p.begin() + static_cast<std::ptrdiff_t>(first), p.end());
}

std::string Quoted(std::string_view word) {
  return "'" + std::string(word.substr(0, 40)) + "'";
}

Result<std::vector<double>> Numbers(const cv::FileNode& node, const std::string& name) {
  const cv::FileNode data = node.isMap() ? node["data"] : node;
  if (!data.isSeq())
    return Status::InvalidArgument("camera file: " + name + " is missing or no matrix");
  std::vector<double> numbers;
  for (const cv::FileNode& number : data) {
    if (numbers.size() == 64)
      return Status::InvalidArgument("camera file: " + name + " has too many numbers");
    if (!number.isReal() && !number.isInt()) {
      return Status::InvalidArgument("camera file: " + name +
                                     " holds something that is not a number");
    }
    numbers.push_back(static_cast<double>(number));
  }
  return numbers;
}

Result<KnownCamera> ReadStorage(const std::string& text) {
  const cv::FileStorage storage(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
  if (!storage.isOpened())
    return Status::InvalidArgument("camera file: not a file of OpenCV's FileStorage");
  KnownCamera camera;
  for (const auto& [name, side] : {std::pair("image_width", &camera.size.width_px),
                                   std::pair("image_height", &camera.size.height_px)}) {
    const cv::FileNode node = storage[name];
    const double value = node.isInt() || node.isReal() ? static_cast<double>(node) : 0;
    if (!IsSide(value)) {
      return Status::InvalidArgument(std::string("camera file: ") + name +
                                     " is missing or not in 1..65535");
    }
    *side = static_cast<uint32_t>(value);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<double> k,
                          Numbers(storage["camera_matrix"], "camera_matrix"));
  if (k.size() != 9)
    return Status::InvalidArgument("camera file: camera_matrix does not have 9 numbers");
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    return Status::InvalidArgument("camera file: camera_matrix is not [fx 0 cx; 0 fy cy; 0 0 1]");
  }
  camera.fx = k[0];
  camera.cx = k[2];
  camera.fy = k[4];
  camera.cy = k[5];
  VEDUTA_ASSIGN_OR_RETURN(camera.coefficients,
                          Numbers(storage["distortion_coefficients"], "distortion_coefficients"));
  while (!camera.coefficients.empty() && camera.coefficients.back() == 0)
    camera.coefficients.pop_back();
  return camera;
}

}  // namespace

Result<std::vector<ColmapCamera>> ParseColmapCameras(std::string_view text) {
  static const std::map<std::string, size_t, std::less<>> kParameterCounts = {
      {"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4}, {"SIMPLE_RADIAL", 4}, {"RADIAL", 5}, {"OPENCV", 8}};
  std::vector<ColmapCamera> cameras;
  for (size_t number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::vector<std::string_view> words = Words(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty() || words[0].front() == '#') continue;
    const std::string where = "cameras.txt, line " + std::to_string(number) + ": ";
    ColmapCamera read;
    double width = 0, height = 0;
    if (words.size() < 4 || !Parse(words[0], &read.id) || !Parse(words[2], &width) ||
        !Parse(words[3], &height) || !IsSide(width) || !IsSide(height)) {
      return Status::InvalidArgument(where + "not CAMERA_ID MODEL WIDTH HEIGHT PARAMS...");
    }
    const auto model = kParameterCounts.find(words[1]);
    if (model == kParameterCounts.end()) {
      return Status::InvalidArgument(
          where + "the model " + Quoted(words[1]) +
          " is not one of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV");
    }
    std::vector<double> parameters(words.size() - 4);
    for (size_t i = 0; i < parameters.size(); ++i) {
      if (!Parse(words[4 + i], &parameters[i]) || !std::isfinite(parameters[i])) {
        return Status::InvalidArgument(where + Quoted(words[4 + i]) + " is not a number");
      }
    }
    if (parameters.size() != model->second) {
      return Status::InvalidArgument(where + model->first + " has " +
                                     std::to_string(model->second) + " parameters, not " +
                                     std::to_string(parameters.size()));
    }
    if (cameras.size() == kCamerasMax)
      return Status::InvalidArgument("cameras.txt: more than 100000 cameras");
    read.model = model->first;
    read.camera.size = {static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
    SetParameters(read.model, parameters, &read.camera);
    cameras.push_back(std::move(read));
  }
  if (cameras.empty()) return Status::InvalidArgument("cameras.txt: no camera in it");
  return cameras;
}

Result<KnownCamera> ParseOpenCvCamera(const std::string& text) {
  try {
    // Plain YAML, as ROS writes it, lacks the line that FileStorage wants first.
    const bool is_plain = text.find_first_of("%<{") != text.find_first_not_of(" \t\r\n");
    return ReadStorage(is_plain ? "%YAML:1.0\n---\n" + text : text);
  } catch (const std::exception& error) {  // cv::Exception among them
    return Status::InvalidArgument("camera file: OpenCV cannot read it: " +
                                   std::string(error.what()));
  }
}

}  // namespace veduta
