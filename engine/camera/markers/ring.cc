// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/ring.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/camera/markers/marker_pattern.h"
#include "engine/camera/markers/outline.h"
#include "storage/base/median.h"

namespace veduta {
namespace {

constexpr double kDarkRadius = (1 + kMarkerCodeRadius) / 2;  // the middle of the dark ring
constexpr double kBrightRadius = 1.13;  // about the middle of the quiet zone (marker_pattern.h)

// Chosen by hand; not measured one by one (veduta-bench-markers measures all of them together).
constexpr double kContrastGrayMin = 10;   // from the dark ring to the paper, grey levels
constexpr double kContrastPartMin = 0.4;  // of the median contrast; less where something covers
constexpr int kSharpenedBudget = 4;       // of the second reading, which takes blur off
constexpr int kErrorsMax = 1;             // a sector that is covered is mostly grey, not opposite
constexpr double kBrightnessMin = 0.2;    // of the way from grey to dark or bright; less is grey

// The mean grey value over the middle of a sector, at one or three radii. Nothing if a part of it
// is outside of the image.
template <size_t N>
std::optional<double> SectorMean(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit,
                                 double start_rad, const std::array<double, N>& radii) {
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

// How bright each sector is: -1 as the dark ring, +1 as the paper.
struct Sectors {
  std::array<double, kMarkerBitCount> brightness{};
  uint32_t seen = 0;   // bits of the sectors that show the marker's contrast; the others are 0
  double clarity = 0;  // mean distance from grey, [0, 1]
};

Sectors ReadSectors(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit, double turn_rad) {
  // Three circles within the code's ring, away from its borders.
  constexpr std::array<double, 3> kCodeRadii = {0.64, 0.69, 0.74};
  Sectors sectors;
  std::array<double, kMarkerBitCount> contrast{};
  for (int i = 0; i < kMarkerBitCount; ++i) {
    const double start_rad = turn_rad + 2 * std::numbers::pi * i / kMarkerBitCount;
    const auto dark = SectorMean<1>(gray, image_from_unit, start_rad, {kDarkRadius});
    const auto bright = SectorMean<1>(gray, image_from_unit, start_rad, {kBrightRadius});
    const auto code = SectorMean<3>(gray, image_from_unit, start_rad, kCodeRadii);
    if (!dark || !bright || !code) continue;
    contrast[i] = *bright - *dark;
    sectors.brightness[i] = (*code - 0.5 * (*dark + *bright)) / std::max(0.5 * contrast[i], 1.0);
  }
  const double usual = MedianOf(std::vector<double>(contrast.begin(), contrast.end()));
  const double contrast_min = std::max(kContrastGrayMin, kContrastPartMin * usual);
  for (int i = 0; i < kMarkerBitCount; ++i) {
    if (contrast[i] < contrast_min) {
      sectors.brightness[i] = 0;
      continue;
    }
    sectors.seen |= 1u << i;
    sectors.clarity += std::min(std::abs(sectors.brightness[i]), 1.0) / kMarkerBitCount;
  }
  return sectors;
}

// Decodes the sectors. Blur adds a part of each sector's neighbours to it; `blurred_part` of their
// mean is taken off first.
std::optional<RingReading> Decode(const Sectors& sectors, double blurred_part, int budget) {
  uint32_t word = 0, known = 0;
  for (int i = 0; i < kMarkerBitCount; ++i) {
    const double before = sectors.brightness[(i + kMarkerBitCount - 1) % kMarkerBitCount];
    const double after = sectors.brightness[(i + 1) % kMarkerBitCount];
    const double brightness =
        (sectors.brightness[i] - blurred_part * 0.5 * (before + after)) / (1 - blurred_part);
    if ((sectors.seen >> i & 1) == 0 || std::abs(brightness) < kBrightnessMin) continue;
    known |= 1u << i;
    if (brightness > 0) word |= 1u << i;
  }
  const std::optional<MarkerReading> reading = DecodeMarkerWord(word, known, budget);
  if (!reading || reading->rotation != 0 || reading->error_count > kErrorsMax) return std::nullopt;
  return RingReading{reading->id, 0, reading->error_count, kMarkerBitCount - std::popcount(known)};
}

}  // namespace

std::optional<RingReading> ReadRing(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit,
                                    int budget) {
  constexpr double kBlurredPart = 0.3;  // see Decode; chosen by hand, not measured
  // 23 is odd, so that a reading that is off by half a turn sees one half each of two sectors. The
  // clearer of the two readings is therefore the right one.
  const Sectors ahead = ReadSectors(gray, image_from_unit, 0);
  const Sectors back = ReadSectors(gray, image_from_unit, std::numbers::pi);
  const bool is_ahead = ahead.clarity >= back.clarity;
  std::optional<RingReading> ring = Decode(is_ahead ? ahead : back, 0, budget);
  // A second reading takes blur off, and may be wrong in fewer sectors.
  if (!ring)
    ring = Decode(is_ahead ? ahead : back, kBlurredPart, std::min(budget, kSharpenedBudget));
  if (ring && !is_ahead) ring->turn_rad = std::numbers::pi;
  return ring;
}

}  // namespace veduta
