// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/camera_group.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/camera/orientation.h"

namespace veduta {
namespace {

const double kFilmDiagonalMm = std::hypot(36, 24);
constexpr double kFocalShareMin = 0.3, kFocalShareMax = 20;

std::string Short(double number) {
  char text[32];
  const auto [end, error] =
      std::to_chars(text, text + sizeof(text), number, std::chars_format::general, 4);
  return {text, end};
}

}  // namespace

std::string CameraGroupOf(const ExifCamera& camera, const PhotoHeader& header) {
  if (camera.model.empty() || camera.focal_mm <= 0) return {};
  // Some write the make at the front of the model, too.
  const bool has_make = camera.make.empty() || camera.model.starts_with(camera.make);
  std::string name = has_make ? camera.model : camera.make + " " + camera.model;
  if (!camera.lens.empty()) name += ", " + camera.lens;
  name += ", " + Short(camera.focal_mm) + " mm";
  if (camera.digital_zoom > 1) name += ", zoom " + Short(camera.digital_zoom);
  const ImageSize size = UprightSize(header.stored_size, header.orientation);
  name += ", " + std::to_string(size.width_px) + "x" + std::to_string(size.height_px);
  // The sensor's middle lies elsewhere in a photo that was turned.
  if (header.orientation != 1) name += ", turned " + std::to_string(header.orientation);
  return name;
}

std::optional<double> FocalShareOf(const ExifCamera& camera, const ImageSize& size) {
  const double width_px = size.width_px, height_px = size.height_px;
  const double share = camera.focal_35mm / kFilmDiagonalMm * std::hypot(width_px, height_px) /
                       std::max({width_px, height_px, 1.0});
  if (!(share >= kFocalShareMin && share <= kFocalShareMax)) return std::nullopt;
  return share;
}

}  // namespace veduta
