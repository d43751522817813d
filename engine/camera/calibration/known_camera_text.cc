// SPDX-License-Identifier: Apache-2.0
// The files of COLMAP and OpenCV. OpenCV's own FileStorage is not used: version 4.6 reads past the
// end of damaged files.
#include <tinyxml2.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <map>

#include "engine/camera/calibration/known_camera.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

constexpr size_t kCamerasMax = 100'000;  // in one cameras.txt; chosen by hand

std::vector<std::string_view> Words(std::string_view line) {
  std::vector<std::string_view> words;
  for (size_t at = 0;;) {
    at = line.find_first_not_of(" \t\r\n", at);
    if (at == std::string_view::npos) return words;
    const size_t end = std::min(line.find_first_of(" \t\r\n", at), line.size());
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
void SetParameters(const std::string& model, std::span<const double> p, KnownCamera* camera) {
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

Status WrongField(const std::string& name, const std::string& what) {
  return Status::InvalidArgument("camera file: " + name + " " + what);
}

constexpr size_t kNumbersMax = 64;  // in a matrix; OpenCV's models have 14 at most

// A field of a file of OpenCV's FileStorage: a number, or the data of a matrix; empty where there
// is no such field.
using FieldReader = std::function<Result<std::vector<double>>(const std::string& name)>;

Result<std::vector<double>> YamlNumbers(const YAML::Node& file, const std::string& name) {
  YAML::Node node = file[name];
  if (!node) return std::vector<double>();
  if (node.IsScalar()) return std::vector<double>{node.as<double>()};
  if (node.IsMap()) node.reset(node["data"]);
  if (!node || !node.IsSequence()) return WrongField(name, "is no matrix");
  std::vector<double> numbers;
  for (const YAML::Node& number : node) {
    if (numbers.size() == kNumbersMax) return WrongField(name, "has too many numbers");
    numbers.push_back(number.as<double>());
  }
  return numbers;
}

Result<std::vector<double>> XmlNumbers(const tinyxml2::XMLElement& file, const std::string& name) {
  const tinyxml2::XMLElement* node = file.FirstChildElement(name.c_str());
  if (node != nullptr && node->FirstChildElement("data")) node = node->FirstChildElement("data");
  std::vector<double> numbers;
  if (node == nullptr || node->GetText() == nullptr) return numbers;
  for (const std::string_view word : Words(node->GetText())) {
    if (numbers.size() == kNumbersMax) return WrongField(name, "has too many numbers");
    if (!Parse(word, &numbers.emplace_back())) {
      return WrongField(name, "holds " + Quoted(word) + ", which is not a number");
    }
  }
  return numbers;
}

Result<KnownCamera> ReadFields(const FieldReader& field) {
  KnownCamera camera;
  for (const auto& [name, side] : {std::pair("image_width", &camera.size.width_px),
                                   std::pair("image_height", &camera.size.height_px)}) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<double> value, field(name));
    if (value.size() != 1 || !IsSide(value[0]))
      return WrongField(name, "is missing or not in 1..65535");
    *side = static_cast<uint32_t>(value[0]);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<double> k, field("camera_matrix"));
  if (k.size() != 9) return WrongField("camera_matrix", "does not have 9 numbers");
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    return WrongField("camera_matrix", "is not [fx 0 cx; 0 fy cy; 0 0 1]");
  camera.fx = k[0];
  camera.cx = k[2];
  camera.fy = k[4];
  camera.cy = k[5];
  VEDUTA_ASSIGN_OR_RETURN(camera.coefficients, field("distortion_coefficients"));
  if (camera.coefficients.empty()) return WrongField("distortion_coefficients", "is missing");
  while (!camera.coefficients.empty() && camera.coefficients.back() == 0)
    camera.coefficients.pop_back();
  return camera;
}

// YAML, and JSON, which is a part of it. OpenCV's first line, %YAML:1.0, is no YAML.
Result<KnownCamera> ReadYaml(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t\r\n");
  const bool has_version = text.compare(first, 5, "%YAML") == 0;
  const size_t begin = has_version ? std::min(text.find('\n', first), text.size()) : first;
  const YAML::Node file = YAML::Load(text.substr(begin));
  if (!file.IsMap())
    return Status::InvalidArgument("camera file: not a file of OpenCV's FileStorage");
  return ReadFields([&](const std::string& name) { return YamlNumbers(file, name); });
}

Result<KnownCamera> ReadXml(const std::string& text) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    return Status::InvalidArgument("camera file: damaged XML: " + std::string(document.ErrorStr()));
  const tinyxml2::XMLElement* const file = document.FirstChildElement("opencv_storage");
  if (file == nullptr)
    return Status::InvalidArgument("camera file: not a file of OpenCV's FileStorage");
  return ReadFields([&](const std::string& name) { return XmlNumbers(*file, name); });
}

}  // namespace

Result<KnownColmapCamera> MakeColmapCamera(uint32_t id, std::string_view model, double width_px,
                                           double height_px, std::span<const double> parameters) {
  static const std::map<std::string, size_t, std::less<>> kParameterCounts = {
      {"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4}, {"SIMPLE_RADIAL", 4}, {"RADIAL", 5}, {"OPENCV", 8}};
  const auto known = kParameterCounts.find(model);
  if (known == kParameterCounts.end()) {
    return Status::InvalidArgument(
        "the model " + Quoted(model) +
        " is not one of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV");
  }
  if (!IsSide(width_px) || !IsSide(height_px))
    return Status::InvalidArgument("its width or height is not in 1..65535");
  if (!std::ranges::all_of(parameters, [](double p) { return std::isfinite(p); }))
    return Status::InvalidArgument("a parameter is not a finite number");
  if (parameters.size() != known->second) {
    return Status::InvalidArgument(known->first + " has " + std::to_string(known->second) +
                                   " parameters, not " + std::to_string(parameters.size()));
  }
  KnownColmapCamera made;
  made.id = id;
  made.model = known->first;
  made.camera.size = {static_cast<uint32_t>(width_px), static_cast<uint32_t>(height_px)};
  SetParameters(made.model, parameters, &made.camera);
  return made;
}

Result<std::vector<KnownColmapCamera>> ParseColmapCameras(std::string_view text) {
  std::vector<KnownColmapCamera> cameras;
  for (size_t number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::vector<std::string_view> words = Words(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words.empty() || words[0].front() == '#') continue;
    const std::string where = "cameras.txt, line " + std::to_string(number) + ": ";
    uint32_t id = 0;
    double width = 0, height = 0;
    if (words.size() < 4 || !Parse(words[0], &id) || !Parse(words[2], &width) ||
        !Parse(words[3], &height) || !IsSide(width) || !IsSide(height)) {
      return Status::InvalidArgument(where + "not CAMERA_ID MODEL WIDTH HEIGHT PARAMS...");
    }
    std::vector<double> parameters(words.size() - 4);
    for (size_t i = 0; i < parameters.size(); ++i) {
      if (!Parse(words[4 + i], &parameters[i]) || !std::isfinite(parameters[i])) {
        return Status::InvalidArgument(where + Quoted(words[4 + i]) + " is not a number");
      }
    }
    if (cameras.size() == kCamerasMax)
      return Status::InvalidArgument("cameras.txt: more than 100000 cameras");
    Result<KnownColmapCamera> made = MakeColmapCamera(id, words[1], width, height, parameters);
    if (!made.ok()) return Status::InvalidArgument(where + made.status().message());
    cameras.push_back(std::move(*made));
  }
  if (cameras.empty()) return Status::InvalidArgument("cameras.txt: no camera in it");
  return cameras;
}

Result<KnownCamera> ParseOpenCvCamera(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return Status::InvalidArgument("camera file: it is empty");
  if (text[first] == '<') return ReadXml(text);
  try {
    return ReadYaml(text);
  } catch (const std::exception& error) {  // YAML::Exception among them
    return Status::InvalidArgument("camera file: damaged YAML or JSON: " +
                                   std::string(error.what()));
  }
}

}  // namespace veduta
