// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/camera_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include "engine/camera/number_text.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

constexpr std::array<const char*, 8> kParamNames = {"fx", "fy", "cx", "cy", "k1", "k2", "u0", "v0"};
constexpr size_t kQuotedLengthMax = 60;  // of what was typed, in messages

std::string Quoted(std::string_view text) {
  const bool is_long = text.size() > kQuotedLengthMax;
  return "'" + std::string(text.substr(0, kQuotedLengthMax)) + (is_long ? "...'" : "'");
}

bool ParseSide(std::string_view text, uint32_t* side) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *side);
  return error == std::errc() && end == text.data() + text.size() && *side >= 1 &&
         *side <= kCameraSideMax;
}

std::vector<std::string_view> SplitAtCommas(std::string_view text) {
  std::vector<std::string_view> fields;
  for (;;) {
    const size_t comma = text.find(',');
    fields.push_back(text.substr(0, comma));
    if (comma == std::string_view::npos || fields.size() > kParamNames.size()) return fields;
    text.remove_prefix(comma + 1);
  }
}

}  // namespace

Result<ImageSize> ParseSize(std::string_view text) {
  const size_t cross = text.find('x');
  ImageSize size;
  if (cross == std::string_view::npos || !ParseSide(text.substr(0, cross), &size.width_px) ||
      !ParseSide(text.substr(cross + 1), &size.height_px)) {
    return Status::InvalidArgument("size " + Quoted(text) +
                                   " is not WIDTHxHEIGHT in px, each 1 to 65535, as in 1536x1024");
  }
  return size;
}

Result<CameraModel> ParseCameraParams(std::string_view text, ImageSize size) {
  const std::vector<std::string_view> fields = SplitAtCommas(text);
  if (fields.size() != 4 && fields.size() != 6 && fields.size() != 8) {
    return Status::InvalidArgument("camera parameters " + Quoted(text) +
                                   " are not 4, 6 or 8 numbers: " + "fx,fy,cx,cy[,k1,k2[,u0,v0]]");
  }
  std::array<double, 8> values{};
  for (size_t i = 0; i < fields.size(); ++i) {
    const char* const end_of_field = fields[i].data() + fields[i].size();
    const auto [end, error] = std::from_chars(fields[i].data(), end_of_field, values[i]);
    if (error == std::errc::result_out_of_range) {
      return Status::InvalidArgument(std::string(kParamNames[i]) + " = " + Quoted(fields[i]) +
                                     " is out of the range of numbers");
    }
    if (error != std::errc() || end != end_of_field || !std::isfinite(values[i])) {
      return Status::InvalidArgument(std::string(kParamNames[i]) + " = " + Quoted(fields[i]) +
                                     " is not a number");
    }
  }
  CameraModel model;
  model.width_px = size.width_px;
  model.height_px = size.height_px;
  model.fx = values[0];
  model.fy = values[1];
  model.cx = values[2];
  model.cy = values[3];
  model.k1 = values[4];
  model.k2 = values[5];
  const bool has_own_center = fields.size() == 8;
  model.u0 = has_own_center ? values[6] : model.cx;
  model.v0 = has_own_center ? values[7] : model.cy;
  VEDUTA_RETURN_IF_ERROR(CheckCamera(model));
  return model;
}

std::string CameraParamsText(const CameraModel& model) {
  std::string text = NumberText(model.fx) + "," + NumberText(model.fy) + "," +
                     NumberText(model.cx) + "," + NumberText(model.cy);
  const bool has_own_center = model.u0 != model.cx || model.v0 != model.cy;
  if (IsDistorted(model) || has_own_center)
    text += "," + NumberText(model.k1) + "," + NumberText(model.k2);
  if (has_own_center) text += "," + NumberText(model.u0) + "," + NumberText(model.v0);
  return text;
}

}  // namespace veduta
