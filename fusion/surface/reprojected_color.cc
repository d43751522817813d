// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/reprojected_color.h"

#include <algorithm>
#include <cstdlib>
#include <string>

#include "fusion/surface/color_view.h"

namespace veduta {
namespace {

constexpr int kMagnified = 3;  // differences, for the eye

Status Check(const Picture& picture, const View& view, const Eigen::Vector3f& gain) {
  const size_t pixels = size_t{view.geometry.width_px} * view.geometry.height_px;
  if (view.rgb.size() != 3 * pixels) {
    return Status::InvalidArgument("photo " + std::to_string(view.image.value) +
                                   ": no colours of its size");
  }
  if (picture.width_px != view.geometry.width_px || picture.height_px != view.geometry.height_px ||
      picture.rgb.size() != 3 * pixels || picture.depth.size() != pixels) {
    return Status::InvalidArgument("the picture is not of the size of photo " +
                                   std::to_string(view.image.value));
  }
  if (!gain.allFinite() || gain.minCoeff() <= 0)
    return Status::InvalidArgument("a gain is not finite and positive");
  return {};
}

// What each value of each channel becomes.
using ToneTable = std::array<std::array<uint8_t, 256>, 3>;

ToneTable Balanced(const Eigen::Vector3f& gain) {
  ToneTable table;
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < 256; ++i)
      table[c][i] = SrgbFromLight(LightFromSrgb(static_cast<uint8_t>(i)) * gain[c]);
  }
  return table;
}

using Histogram = std::array<uint64_t, 256>;

double Median(const Histogram& histogram, uint64_t total) {
  uint64_t sum = 0;
  for (size_t i = 0; i < histogram.size(); ++i) {
    sum += histogram[i];
    if (sum > 0 && 2 * sum >= total) return static_cast<double>(i);
  }
  return 0;
}

}  // namespace

Result<ReprojectedColor> CompareWithPhoto(const Picture& picture, const View& view,
                                          const Eigen::Vector3f& gain) {
  VEDUTA_RETURN_IF_ERROR(Check(picture, view, gain));
  const ToneTable balanced = Balanced(gain);
  Histogram plain = {}, even = {};
  uint64_t covered = 0;
  for (size_t i = 0; i < picture.depth.size(); ++i) {
    if (picture.depth[i] <= 0) continue;
    ++covered;
    for (size_t c = 0; c < 3; ++c) {
      const int drawn = picture.rgb[3 * i + c], photo = view.rgb[3 * i + c];
      ++plain[std::abs(drawn - photo)];
      ++even[std::abs(drawn - balanced[c][photo])];
    }
  }
  ReprojectedColor result;
  if (covered == 0) return result;
  result.covered_share = static_cast<double>(covered) / static_cast<double>(picture.depth.size());
  result.median_error = Median(plain, 3 * covered);
  result.median_error_balanced = Median(even, 3 * covered);
  for (size_t i = 0; i < even.size(); ++i)
    result.mean_error_balanced += static_cast<double>(i * even[i]);
  result.mean_error_balanced /= static_cast<double>(3 * covered);
  return result;
}

Result<Picture> SideBySide(const Picture& picture, const View& view, const Eigen::Vector3f& gain) {
  VEDUTA_RETURN_IF_ERROR(Check(picture, view, gain));
  const ToneTable balanced = Balanced(gain);
  Picture sheet = {3 * picture.width_px, picture.height_px, {}, {}};
  sheet.rgb.resize(9 * picture.depth.size());
  sheet.depth.resize(3 * picture.depth.size());
  for (size_t i = 0; i < picture.depth.size(); ++i) {
    const size_t at = i / picture.width_px * sheet.width_px + i % picture.width_px;
    for (size_t c = 0; c < 3; ++c) {
      const uint8_t photo = balanced[c][view.rgb[3 * i + c]], drawn = picture.rgb[3 * i + c];
      const int difference = picture.depth[i] > 0 ? std::abs(photo - drawn) : 0;
      sheet.rgb[3 * at + c] = photo;
      sheet.rgb[3 * (at + picture.width_px) + c] = drawn;
      sheet.rgb[3 * (at + 2 * size_t{picture.width_px}) + c] =
          static_cast<uint8_t>(std::min(255, kMagnified * difference));
    }
    sheet.depth[at] = sheet.depth[at + picture.width_px] = picture.depth[i];
  }
  return sheet;
}

}  // namespace veduta
