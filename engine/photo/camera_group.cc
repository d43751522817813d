// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/camera_group.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/camera/orientation.h"

namespace veduta {
namespace {

const double kFilmDiagonalMm = std::hypot(36, 24);
constexpr double kFocalShareMin = 0.3, kFocalShareMax = 20;
// By so much the sides' ratio of a photo that was only made smaller may differ by rounding.
constexpr double kRatioTimesMax = 1.02;

// The longer side first.
std::pair<uint32_t, uint32_t> SidesOf(uint32_t width_px, uint32_t height_px) {
  return {std::max(width_px, height_px), std::min(width_px, height_px)};
}

bool IsTold(const ExifCamera& camera) {
  return camera.taken_width_px > 0;
}

// Whether the photo has all of the picture that was taken, however large.
bool HasTakenRatio(const ExifCamera& camera, const ImageSize& size) {
  const auto [taken_long, taken_short] = SidesOf(camera.taken_width_px, camera.taken_height_px);
  const auto [is_long, is_short] = SidesOf(size.width_px, size.height_px);
  const double times = (static_cast<double>(taken_long) * is_short) /
                       (static_cast<double>(taken_short) * std::max(is_long, 1u));
  return times <= kRatioTimesMax && times * kRatioTimesMax >= 1;
}

// What its first photo told, which may be off by a fifth and more, for that of others is off alike;
// where it told nothing, what it is.
double ToldShareOf(const CameraRecord& camera) {
  const CameraModel& model = camera.model;
  return camera.told_focal_share > 0 ? camera.told_focal_share
                                     : model.fx / std::max({model.width_px, model.height_px, 1u});
}

std::string Short(double number) {
  char text[32];
  const auto [end, error] =
      std::to_chars(text, text + sizeof(text), number, std::chars_format::general, 4);
  return {text, end};
}

}  // namespace

std::string CameraGroupOf(const ExifCamera& camera, const PhotoHeader& header) {
  if (camera.model.empty() || camera.focal_mm <= 0) return {};
  const ImageSize& stored = header.stored_size;
  if (IsTold(camera) && SidesOf(camera.taken_width_px, camera.taken_height_px) !=
                            SidesOf(stored.width_px, stored.height_px))
    return {};
  // Some write the make at the front of the model, too.
  const bool has_make = camera.make.empty() || camera.model.starts_with(camera.make);
  std::string name = has_make ? camera.model : camera.make + " " + camera.model;
  if (!camera.lens.empty()) name += ", " + camera.lens;
  name += ", " + Short(camera.focal_mm) + " mm";
  if (camera.digital_zoom > 1) name += ", zoom " + Short(camera.digital_zoom);
  const ImageSize size = UprightSize(header.stored_size, header.orientation);
  name += ", " + std::to_string(size.width_px) + "x" + std::to_string(size.height_px);
  // The sensor's middle lies elsewhere in a photo that was turned.
  if (header.sensor_orientation != 1)
    name += ", turned " + std::to_string(header.sensor_orientation);
  return name;
}

std::string SilentGroupOf(const ImageSize& size) {
  return "photos of " + size.Text();
}

Result<std::optional<CameraRecord>> FindGroupCamera(const Snapshot& snapshot,
                                                    const std::string& group,
                                                    std::optional<double> focal_share) {
  if (group.empty()) return std::optional<CameraRecord>();
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraRecord> cameras, snapshot.ListCameras());
  const auto found = std::ranges::find_if(cameras, [&](const CameraRecord& camera) {
    return IsNumberedName(camera.name, group) &&
           IsToldAlike(ToldShareOf(camera), focal_share.value_or(0));
  });
  if (found == cameras.end()) return std::optional<CameraRecord>();
  return std::optional(std::move(*found));
}

bool IsToldAlike(double a_share, double b_share) {
  if (a_share == 0 || b_share == 0) return true;
  return std::max(a_share, b_share) <= kToldTimesMax * std::min(a_share, b_share);
}

std::string NumberedName(const std::string& name,
                         const std::function<bool(const std::string& name)>& is_taken) {
  std::string numbered = name;
  for (uint32_t number = 2; is_taken(numbered); ++number)
    numbered = name + " (" + std::to_string(number) + ")";
  return numbered;
}

bool IsNumberedName(const std::string& numbered, const std::string& name) {
  if (numbered == name) return true;
  const std::string begin = name + " (";
  if (!numbered.starts_with(begin) || !numbered.ends_with(')')) return false;
  const std::string_view number =
      std::string_view(numbered).substr(begin.size(), numbered.size() - begin.size() - 1);
  return !number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos;
}

std::optional<double> FocalShareOf(const ExifCamera& camera, const ImageSize& size) {
  if (IsTold(camera) && !HasTakenRatio(camera, size)) return std::nullopt;
  const double width_px = size.width_px, height_px = size.height_px;
  const double share = camera.focal_35mm / kFilmDiagonalMm * std::hypot(width_px, height_px) /
                       std::max({width_px, height_px, 1.0});
  if (!(share >= kFocalShareMin && share <= kFocalShareMax)) return std::nullopt;
  return share;
}

}  // namespace veduta
