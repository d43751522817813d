// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/calibration_advice.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "engine/camera/calibration/plane_adjustment.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

// What a good calibration keeps; beyond, there is a warning. Chosen by hand; not measured.
constexpr double kFocalSigmaGood = 0.003;       // of the focal length
constexpr double kPrincipalSigmaGood = 0.01;    // of the longer side
constexpr double kDistortionSigmaGood = 0.001;  // of the longer side, 1.6 px of 1600
constexpr double kErrorGood = 0.0005;           // of the longer side, 0.8 px of 1600
constexpr double kLeftOutGood = 0.15;           // of the observations in photos that were used
constexpr uint32_t kPhotosGood = 8;
constexpr double kDistanceRatioGood = 1.25;  // of the farthest photo over the nearest
constexpr size_t kListedMax = 12;            // items of a list in a message

std::string Number(double value, int digits) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

template <typename Items, typename Text>
std::string Listed(const Items& items, Text text) {
  std::string list;
  size_t count = 0;
  for (const auto& item : items) {
    if (count++ == kListedMax)
      return list + " and " + std::to_string(items.size() - kListedMax) + " more";
    list += (count > 1 ? ", " : "") + text(item);
  }
  return list;
}

using Warnings = std::vector<CalibrationWarning>;

void AdviseOnPhotos(const Calibration& c, Warnings* warnings) {
  uint32_t used = 0;
  for (const CalibrationPhoto& photo : c.photos) {
    if (photo.why_left_out.empty()) {
      ++used;
    } else {
      warnings->push_back(
          {CalibrationAdvice::kPhotoLeftOut, photo.name + " was left out: " + photo.why_left_out});
    }
  }
  if (used < kPhotosGood) {
    warnings->push_back({CalibrationAdvice::kFewPhotos,
                         "only " + std::to_string(used) + " photos were used: take at least " +
                             std::to_string(kPhotosGood) +
                             ", from all sides, most of them tilted by 30 to 50 degrees"});
  }
}

void AdviseOnPoints(const Calibration& c, Warnings* warnings) {
  std::map<uint32_t, std::set<uint32_t>> photos_of;  // by id: the photos in which it was left out
  std::map<uint32_t, uint32_t> used_count_of;        // by id: in how many photos it was used
  for (const CalibrationResidual& r : c.residuals) used_count_of[r.id] += r.is_used;
  size_t count = 0, left_out = 0;
  for (const CalibrationResidual& r : c.residuals) {
    // A point that is used in fewer than 2 photos contradicts nothing.
    if (!c.photos[r.photo].why_left_out.empty() || used_count_of[r.id] < 2) continue;
    ++count;
    if (!r.is_used) {
      photos_of[r.id].insert(r.photo);
      ++left_out;
    }
  }
  std::set<uint32_t> moved, moved_in;
  std::vector<std::pair<uint32_t, uint32_t>> misread;  // id, photo
  for (const auto& [id, photos] : photos_of) {
    if (photos.size() > 1) {
      moved.insert(id);
      moved_in.insert(photos.begin(), photos.end());
    } else {
      misread.emplace_back(id, *photos.begin());
    }
  }
  const auto name = [&](uint32_t photo) { return c.photos[photo].name; };
  const auto number = [](uint32_t id) { return std::to_string(id); };
  if (!moved.empty()) {
    warnings->push_back({CalibrationAdvice::kPointsLeftOut,
                         "left out of " + Listed(moved_in, name) + ": points " +
                             Listed(moved, number) +
                             ", which lie elsewhere than in the other photos; was their sheet "
                             "moved, or does something cover them?"});
  }
  if (!misread.empty()) {
    warnings->push_back({CalibrationAdvice::kPointsLeftOut,
                         "left out once, misread or blurred: " +
                             Listed(misread, [&](const std::pair<uint32_t, uint32_t>& m) {
                               return "point " + number(m.first) + " in " + name(m.second);
                             })});
  }
  if (static_cast<double>(left_out) > kLeftOutGood * static_cast<double>(count)) {
    warnings->push_back({CalibrationAdvice::kManyLeftOut,
                         std::to_string(left_out) + " of " + std::to_string(count) +
                             " observations contradict the others and were left out: leave the "
                             "sheets where they lie "
                             "during a session, and begin a new one after they were moved"});
  }
}

std::string TiltAdvice(const Calibration& c) {
  double least = 90, most = 0;
  for (const CalibrationPhoto& photo : c.photos) {
    if (!photo.why_left_out.empty()) continue;
    least = std::min(least, photo.tilt_deg);
    most = std::max(most, photo.tilt_deg);
  }
  return "tilt the camera more: the photos look at the sheets from " + Number(least, 0) + " to " +
         Number(most, 0) + " degrees off the upright; take some at 30 to 50 degrees from each side";
}

// Names the corners of the photo, a sixth of each side wide, that hold no observation.
std::string CornerAdvice(const Calibration& c) {
  std::array<bool, 4> has = {false, false, false, false};
  for (const CalibrationResidual& r : c.residuals) {
    const double x = r.px.x() / c.model.width_px, y = r.px.y() / c.model.height_px;
    if (r.is_used && std::min(x, 1 - x) < 1. / 6 && std::min(y, 1 - y) < 1. / 6)
      has[(x > 0.5) + 2 * (y > 0.5)] = true;
  }
  constexpr std::array<const char*, 4> kNames = {"top left", "top right", "bottom left",
                                                 "bottom right"};
  std::vector<std::string> missing;
  for (size_t i = 0; i < 4; ++i) {
    if (!has[i]) missing.push_back(kNames[i]);
  }
  if (missing.empty()) return "photograph more markers near the corners and edges of the photo";
  return "photograph the corners: no marker was seen in the photo's " +
         Listed(missing, [](const std::string& corner) { return corner; }) + " corner";
}

void AdviseOnParameters(const Calibration& c, Warnings* warnings) {
  const double side = std::max(c.model.width_px, c.model.height_px);
  const double focal_sigma = c.Sigma(0) / c.model.fx;
  const size_t before = warnings->size();
  if (focal_sigma > kFocalSigmaGood) {
    warnings->push_back({CalibrationAdvice::kFocalLength, "the focal length is uncertain by " +
                                                              Number(100 * focal_sigma, 1) +
                                                              " %: " + TiltAdvice(c)});
  }
  const double principal_sigma_px = std::max(c.Sigma(2), c.Sigma(3));
  if (principal_sigma_px > kPrincipalSigmaGood * side) {
    warnings->push_back({CalibrationAdvice::kPrincipalPoint,
                         "the principal point is uncertain by " + Number(principal_sigma_px, 0) +
                             " px: tilt the camera to all sides, and turn it by 90 degrees about "
                             "its axis for some"});
  }
  if (c.distortion_sigma_px > kDistortionSigmaGood * side) {
    warnings->push_back({CalibrationAdvice::kDistortion,
                         "the distortion is uncertain by " + Number(c.distortion_sigma_px, 1) +
                             " px somewhere in the photo: " + CornerAdvice(c)});
  }
  double nearest = 1e300, farthest = 0;
  for (const CalibrationPhoto& photo : c.photos) {
    if (!photo.why_left_out.empty()) continue;
    nearest = std::min(nearest, photo.distance);
    farthest = std::max(farthest, photo.distance);
  }
  if (warnings->size() > before && farthest < kDistanceRatioGood * nearest) {
    warnings->push_back(
        {CalibrationAdvice::kOneDistance,
         "all photos are from one distance: go nearer for some, farther for others"});
  }
  if (c.error_px_rms > kErrorGood * side) {
    warnings->push_back({CalibrationAdvice::kResidual,
                         "the model misses the points by " + Number(c.error_px_rms, 2) +
                             " px: are the photos in focus and not shaken, do the sheets lie flat, "
                             "did zoom, focus or "
                             "stabiliser change? A fisheye lens is not what this model describes"});
  }
}

}  // namespace

std::vector<CalibrationWarning> Advise(const Calibration& calibration) {
  Warnings warnings;
  AdviseOnPhotos(calibration, &warnings);
  AdviseOnPoints(calibration, &warnings);
  AdviseOnParameters(calibration, &warnings);
  return warnings;
}

double LargestDistortionSigma(const CameraModel& model,
                              const Eigen::Matrix<double, 8, 8>& covariance) {
  const std::array<double, 8> values = IntrinsicsOf(model);
  double largest = 0;
  for (int row = 0; row <= 6; ++row) {
    for (int column = 0; column <= 8; ++column) {
      const Eigen::Vector2d px(column * (model.width_px - 1.0) / 8,
                               row * (model.height_px - 1.0) / 6);
      Eigen::Matrix<double, 2, 8> slope;
      for (int k = 0; k < 8; ++k) {
        const double step = 1e-3 * std::sqrt(covariance(k, k));
        slope.col(k).setZero();
        if (!(step > 0)) continue;
        std::array<double, 8> more = values, less = values;
        more[static_cast<size_t>(k)] += step;
        less[static_cast<size_t>(k)] -= step;
        const auto after = UndistortPixel(WithIntrinsics(model, more), px);
        const auto before = UndistortPixel(WithIntrinsics(model, less), px);
        if (after && before) slope.col(k) = (*after - *before) / (2 * step);
      }
      largest = std::max(largest, std::sqrt((slope * covariance * slope.transpose()).trace()));
    }
  }
  return largest;
}

std::vector<bool> CoveredCells(const Calibration& calibration) {
  std::vector<bool> covered(kCoverageAcross * kCoverageDown);
  const CameraModel& model = calibration.model;
  for (const CalibrationResidual& r : calibration.residuals) {
    if (!r.is_used) continue;
    const int column = static_cast<int>((r.px.x() + 0.5) * kCoverageAcross / model.width_px);
    const int row = static_cast<int>((r.px.y() + 0.5) * kCoverageDown / model.height_px);
    const int cell = std::clamp(row, 0, kCoverageDown - 1) * kCoverageAcross +
                     std::clamp(column, 0, kCoverageAcross - 1);
    covered[static_cast<size_t>(cell)] = true;
  }
  return covered;
}

double CoveredShare(const Calibration& calibration) {
  const std::vector<bool> covered = CoveredCells(calibration);
  return static_cast<double>(std::count(covered.begin(), covered.end(), true)) /
         static_cast<double>(covered.size());
}

}  // namespace veduta
