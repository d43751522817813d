// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "engine/camera/photo_decoder.h"
#include "storage/base/median.h"
#include "tools/markers/bench.h"
#include "tools/markers/photo_file.h"

namespace veduta::floor {
namespace {

namespace fs = std::filesystem;

Result<std::vector<MarkerTruth>> ReadTruth(const fs::path& path) {
  std::ifstream file(path);
  if (!file) return Status::IoError("cannot read " + path.string());
  std::vector<MarkerTruth> truths;
  MarkerTruth t;
  while (file >> t.id >> t.px.x() >> t.px.y() >> t.diameter_px >> t.tilt_deg >> t.cover >>
         t.is_whole) {
    truths.push_back(t);
  }
  return truths;
}

}  // namespace

PhotoOutcome Compare(const std::vector<MarkerTruth>& truths,
                     const std::vector<MarkerDetection>& found) {
  constexpr double kWrongPx = 3;
  PhotoOutcome outcome;
  for (const MarkerTruth& truth : truths) outcome.markers.push_back({.truth = truth});
  for (const MarkerDetection& marker : found) {
    const auto match =
        std::find_if(outcome.markers.begin(), outcome.markers.end(),
                     [&](const MarkerOutcome& o) { return o.truth.id == marker.id; });
    if (match == outcome.markers.end() || (match->truth.px - marker.center_px).norm() > kWrongPx) {
      ++outcome.wrong_count;
      continue;
    }
    const Eigen::Vector2d error = marker.center_px - match->truth.px;
    match->is_found = true;
    match->error_px = error.norm();
    match->error_x_px = error.x();
    match->error_y_px = error.y();
    match->ellipse_error_px = (marker.outline.center - match->truth.px).norm();
    match->sigma_px = marker.SigmaPx();
    match->mahalanobis2 = error.dot(marker.covariance_px2.inverse() * error);
  }
  return outcome;
}

double Percentile(std::vector<double> values, double part) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return QuantileInPlace(values, part);
}

void PrintOutcome(const std::string& label, const std::vector<PhotoOutcome>& outcomes,
                  std::optional<double> seconds) {
  int whole = 0, whole_found = 0, found = 0, wrong = 0;
  std::vector<double> errors, ellipse_errors, sigmas, squares;
  for (const PhotoOutcome& outcome : outcomes) {
    wrong += outcome.wrong_count;
    for (const MarkerOutcome& m : outcome.markers) {
      const bool is_whole = m.truth.is_whole && m.truth.cover == 0;
      whole += is_whole;
      whole_found += is_whole && m.is_found;
      found += m.is_found;
      if (!m.is_found) continue;
      errors.push_back(m.error_px);
      ellipse_errors.push_back(m.ellipse_error_px);
      sigmas.push_back(m.sigma_px);
      squares.push_back(m.mahalanobis2);
    }
  }
  // Of two degrees of freedom the median of the squared error is 2 ln 2 = 1.386 and the 95th
  // percentile 5.99.
  std::printf(
      "%-26s %5d/%-5d %5.1f%% %5d found %3d wrong | error %.4f %.4f | ellipse %.3f %.3f | sigma "
      "%.4f | "
      "chi2/expected %.2f %.2f",
      label.c_str(), whole_found, whole, 100.0 * whole_found / std::max(whole, 1), found, wrong,
      Percentile(errors, 0.5), Percentile(errors, 0.95), Percentile(ellipse_errors, 0.5),
      Percentile(ellipse_errors, 0.95), Percentile(sigmas, 0.5), Percentile(squares, 0.5) / 1.386,
      Percentile(squares, 0.95) / 5.991);
  if (seconds)
    std::printf(" | %.0f ms",
                1e3 * *seconds / std::max<double>(static_cast<double>(outcomes.size()), 1));
  std::printf("\n");
  std::fflush(stdout);
}

int RunSession(const std::string& folder) {
  std::vector<fs::path> photos;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(fs::path(folder) / "photos", error))
    photos.push_back(entry.path());
  std::sort(photos.begin(), photos.end());
  std::vector<PhotoOutcome> all;
  double seconds = 0;
  for (const fs::path& path : photos) {
    const auto truths =
        ReadTruth(fs::path(folder) / "truth" / (path.filename().string() + ".markers"));
    const DecodedPhoto photo = ReadPhoto(path.string());
    if (!truths.ok() || photo.gray.empty()) {
      std::fprintf(stderr, "veduta-marker-bench: %s: %s\n", path.c_str(),
                   truths.ok() ? photo.detail.c_str() : truths.status().message().c_str());
      return 1;
    }
    const std::clock_t begin = std::clock();
    const auto search = DetectMarkers(photo.gray);
    const double taken = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    seconds += taken;
    all.push_back(Compare(*truths, search->markers));
    PrintOutcome(path.filename().string() + " " + std::to_string(search->outline_count),
                 {all.back()}, taken);
  }
  PrintOutcome("all", all, seconds);
  return 0;
}

}  // namespace veduta::floor
