// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/ring.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "engine/camera/markers/marker_pattern.h"
#include "engine/camera/markers/outline.h"

namespace veduta {
namespace {

constexpr double kDarkRadius = (1 + kMarkerCodeRadius) / 2;
constexpr double kBrightRadius = 1.13;
constexpr double kContrastGrayMin = 10;
constexpr double kContrastPartMin = 0.4;  // of the median: less, and something lies there
constexpr double kSaidMin = 0.2;          // of the way from the middle to dark or bright: less is grey

// Mean over the middle of a sector, at one or three radii; nothing if some of it is outside of the image.
template <size_t N>
std::optional<double> SectorMean(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit, double start_rad,
                                 const std::array<double, N>& radii) {
  constexpr double kSectorRad = 2 * std::numbers::pi / kMarkerBitCount;
  double sum = 0;
  for (const double part : {0.3, 0.5, 0.7}) {
    const double angle = start_rad + part * kSectorRad;
    for (const double radius : radii) {
      const Eigen::Vector3d unit(radius * std::cos(angle), radius * std::sin(angle), 1);
      const auto value = GrayAt(gray, (image_from_unit * unit).hnormalized());
      if (!value) return std::nullopt;
      sum += *value;
    }
  }
  return sum / (3 * N);
}

struct Sectors {
  uint32_t word = 0, known = 0;
  double clarity = 0;  // mean distance from grey
};

Sectors ReadSectors(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit, double turn_rad) {
  // Within the code's ring, away from its borders.
  constexpr std::array<double, 3> kCodeRadii = {0.635, 0.69, 0.745};
  std::array<double, kMarkerBitCount> said{}, contrast{};
  for (int i = 0; i < kMarkerBitCount; ++i) {
    const double start_rad = turn_rad + 2 * std::numbers::pi * i / kMarkerBitCount;
    const auto dark = SectorMean<1>(gray, image_from_unit, start_rad, {kDarkRadius});
    const auto bright = SectorMean<1>(gray, image_from_unit, start_rad, {kBrightRadius});
    const auto code = SectorMean<3>(gray, image_from_unit, start_rad, kCodeRadii);
    if (!dark || !bright || !code) continue;
    contrast[i] = *bright - *dark;
    said[i] = (*code - 0.5 * (*dark + *bright)) / std::max(0.5 * contrast[i], 1.0);
  }
  std::array<double, kMarkerBitCount> sorted = contrast;
  std::nth_element(sorted.begin(), sorted.begin() + kMarkerBitCount / 2, sorted.end());
  const double contrast_min = std::max(kContrastGrayMin, kContrastPartMin * sorted[kMarkerBitCount / 2]);
  Sectors sectors;
  for (int i = 0; i < kMarkerBitCount; ++i) {
    if (contrast[i] < contrast_min) continue;
    sectors.clarity += std::min(std::abs(said[i]), 1.0) / kMarkerBitCount;
    if (std::abs(said[i]) < kSaidMin) continue;
    sectors.known |= 1u << i;
    if (said[i] > 0) sectors.word |= 1u << i;
  }
  return sectors;
}

}  // namespace

std::optional<RingReading> ReadRing(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit, int budget) {
  // 23 sectors are odd: half a turn on, each looks at halves of two. The clearer of the two is the right one.
  const Sectors ahead = ReadSectors(gray, image_from_unit, 0);
  const Sectors back = ReadSectors(gray, image_from_unit, std::numbers::pi);
  const bool is_ahead = ahead.clarity >= back.clarity;
  const Sectors& sectors = is_ahead ? ahead : back;
  const std::optional<MarkerReading> reading = DecodeMarkerWord(sectors.word, sectors.known, budget);
  if (!reading || reading->rotation != 0) return std::nullopt;
  const int erasure_count = kMarkerBitCount - std::popcount(sectors.known);
  return RingReading{reading->id, is_ahead ? 0 : std::numbers::pi, reading->error_count, erasure_count};
}

}  // namespace veduta
