// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/files/points_file.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "engine/camera/projection.h"

namespace veduta {
namespace {

using Json = nlohmann::json;

// The format nests 5 deep; members that are ignored may nest a little deeper. Chosen by hand.
constexpr int kDepthMax = 8;
// In px, either way. 15 times the longest side that a camera may have; chosen by hand.
constexpr double kCoordinateMax = 1e6;
// Bounds of a sigma, px: so far apart that only nonsense is refused. Chosen by hand.
constexpr double kSigmaMin = 1e-6, kSigmaMax = 1e6;
constexpr size_t kNameShownMax = 80;  // letters of a photo's name that a message repeats

// What is wrong with the file, in words. Thrown deep inside the reading of the JSON and caught by
// ParsePoints; it never leaves this file.
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
  const std::string where = place + " '" + view.name.substr(0, kNameShownMax) + "'";
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
      seen.sigma_px = Number(point["sigma"], kSigmaMin, kSigmaMax, at + ": \"sigma\"");
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
      throw Fault("two views are named '" + view.name.substr(0, kNameShownMax) + "'");
    for (const PointObservation& point : view.points) ids.insert(point.id);
    if (ids.size() > kDistinctPointsMax) {
      throw Fault("more than " + std::to_string(kDistinctPointsMax) + " different points");
    }
  }
  return input;
}

}  // namespace

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
