// SPDX-License-Identifier: Apache-2.0
#include "cli/calibration/points_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "engine/camera/projection.h"

namespace veduta {
namespace {

using Json = nlohmann::json;

constexpr int kDepthMax = 8;
constexpr double kCoordinateMax = 1e6;  // px

// Thrown and caught in this file alone: where it happens, the parser is deep inside.
struct Fault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

const Json& Member(const Json& object, const char* name, const std::string& where) {
  if (!object.is_object()) throw Fault(where + " is not an object");
  const auto found = object.find(name);
  if (found == object.end()) throw Fault(where + " has no \"" + name + "\"");
  return *found;
}

double Number(const Json& value, double low, double high, const std::string& what) {
  const double number = value.is_number() ? value.get<double>() : std::nan("");
  if (!(number >= low && number <= high)) {
    throw Fault(what + " is not a number from " + Json(low).dump() + " to " + Json(high).dump());
  }
  return number;
}

uint32_t WholeNumber(const Json& value, uint64_t low, uint64_t high, const std::string& what) {
  if (!value.is_number_unsigned() || value.get<uint64_t>() < low || value.get<uint64_t>() > high) {
    throw Fault(what + " is not a whole number from " + std::to_string(low) + " to " +
                std::to_string(high));
  }
  return static_cast<uint32_t>(value.get<uint64_t>());
}

ImageSize SizeOf(const Json& object, const std::string& where) {
  return {WholeNumber(Member(object, "width", where), 1, kCameraSideMax, where + ": \"width\""),
          WholeNumber(Member(object, "height", where), 1, kCameraSideMax, where + ": \"height\"")};
}

ViewObservations ViewOf(const Json& object, ImageSize size, size_t index) {
  ViewObservations view;
  const std::string place = "view " + std::to_string(index + 1);
  const Json& name = Member(object, "name", place);
  if (!name.is_string() || name.get_ref<const std::string&>().empty())
    throw Fault(place + ": \"name\" is no name");
  view.name = name.get<std::string>();
  const std::string where = place + " '" + view.name.substr(0, 80) + "'";
  view.size = object.contains("width") || object.contains("height") ? SizeOf(object, where) : size;
  const Json& points = Member(object, "points", where);
  if (!points.is_array()) throw Fault(where + ": \"points\" is not a list");
  for (const Json& point : points) {
    const std::string at = where + ", point " + std::to_string(view.points.size() + 1);
    PointObservation seen;
    seen.id = WholeNumber(Member(point, "id", at), 0, 0xffffffff, at + ": \"id\"");
    seen.px.x() = Number(Member(point, "x", at), -kCoordinateMax, kCoordinateMax, at + ": \"x\"");
    seen.px.y() = Number(Member(point, "y", at), -kCoordinateMax, kCoordinateMax, at + ": \"y\"");
    if (point.contains("sigma"))
      seen.sigma_px = Number(point["sigma"], 1e-6, 1e6, at + ": \"sigma\"");
    view.points.push_back(seen);
  }
  return view;
}

CalibrationInput InputOf(const Json& root) {
  const ImageSize size = SizeOf(root, "the file");
  const Json& views = Member(root, "views", "the file");
  if (!views.is_array()) throw Fault("\"views\" is not a list");
  if (views.size() > kViewsMax) {
    throw Fault(std::to_string(views.size()) + " views; at most " + std::to_string(kViewsMax) +
                " are taken");
  }
  CalibrationInput input;
  std::set<std::string> names;
  std::set<uint32_t> ids;
  for (const Json& object : views) {
    input.views.push_back(ViewOf(object, size, input.views.size()));
    const ViewObservations& view = input.views.back();
    if (!names.insert(view.name).second)
      throw Fault("two views are named '" + view.name.substr(0, 80) + "'");
    for (const PointObservation& point : view.points) ids.insert(point.id);
    if (ids.size() > kDistinctPointsMax) {
      throw Fault("more than " + std::to_string(kDistinctPointsMax) + " different points");
    }
  }
  return input;
}

}  // namespace

Result<std::string> ReadWholeFile(const std::string& path, size_t size_bytes_max) {
  if (std::filesystem::is_directory(path)) return Status::IoError(path + " is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::IoError("cannot open " + path);
  std::string bytes(64 << 10, '\0');
  std::string text;
  while (file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())), file.gcount() > 0) {
    text.append(bytes.data(), static_cast<size_t>(file.gcount()));
    if (text.size() > size_bytes_max) {
      return Status::InvalidArgument(path + " has more than " + std::to_string(size_bytes_max) +
                                     " bytes");
    }
  }
  if (file.bad()) return Status::IoError("cannot read " + path);
  return text;
}

Result<CalibrationInput> ParsePoints(std::string_view text) {
  const auto stop_at_depth = [](int depth, Json::parse_event_t, Json&) {
    if (depth > kDepthMax) throw Fault("nested too deep");
    return true;
  };
  try {
    return InputOf(Json::parse(text, stop_at_depth));
  } catch (const Fault& fault) {
    return Status::InvalidArgument(std::string("points: ") + fault.what());
  } catch (const Json::exception& error) {
    return Status::InvalidArgument(std::string("points: not JSON: ") + error.what());
  }
}

}  // namespace veduta
