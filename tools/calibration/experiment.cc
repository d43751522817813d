// SPDX-License-Identifier: Apache-2.0
// Synthetic calibration sessions of known truth, points only: how far off the calibration is, beside OpenCV's, which is
// told where the points lie. Prints a line a session and the figures of all.
// usage: veduta-calibration-experiment [--sessions N] [--first N] [--no-opencv] [--poor]
// --poor: sessions that leave much open; what counts is that none of them fails silently.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "engine/camera/calibration/calibrator.h"
#include "engine/camera/calibration/distortion_estimation.h"
#include "engine/camera/calibration/focal_search.h"
#include "engine/camera/calibration/scene_initialization.h"
#include "tools/calibration/opencv_calibration.h"
#include "tools/calibration/synthetic_session.h"

namespace veduta {
namespace {

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<size_t>(share * static_cast<double>(values.size())))];
}

double MillisecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

struct Figures {
  std::vector<double> focal_errors, opencv_errors, search_ms, calibrate_ms, mean_errors_px, distortion_errors_px,
      focal_errors_in_sigma;
  uint32_t within_5_percent = 0, refused = 0, warned = 0, silent = 0;
};

// The search alone: equations 3 and 4 on what the distortion's estimation leaves, timed.
void RunSearch(const SyntheticSession& session, Figures* figures) {
  const PlanarViews planar = MakePlanarViews(session.input);
  ViewTree tree = GrowViewTree(planar.views);
  if (!EstimateDistortion(planar.views, {}, &tree).ok()) return;
  const auto homographies = HomographiesFromReferences(tree, kFocalReferences);
  const auto start = std::chrono::steady_clock::now();
  const auto found = SearchFocalLength(homographies);
  figures->search_ms.push_back(MillisecondsSince(start));
  if (!found) return;
  const double error = found->focal * planar.units.unit_px / session.truth.fx - 1;
  figures->within_5_percent += std::abs(error) < 0.05;
}

void RunSession(uint32_t index, bool with_opencv, bool is_poor, Figures* figures) {
  const SyntheticSession session = is_poor ? MakePoorSession(index) : MakeSession(ExperimentOptions(index));
  const CameraModel& truth = session.truth;
  std::printf("%3u  f/w %.2f  %2zu photos  noise %.2f  k1 %+.3f  ", index, truth.fx / truth.width_px,
              session.input.views.size(),
              session.input.views.front().points.empty() ? 0 : session.input.views.front().points.front().sigma_px,
              truth.k1);
  RunSearch(session, figures);
  const auto start = std::chrono::steady_clock::now();
  const auto made = CalibrateCamera(session.input);
  figures->calibrate_ms.push_back(MillisecondsSince(start));
  if (!made.ok()) {
    std::printf("refused: %s\n", made.status().message().c_str());
    ++figures->refused;
    return;
  }
  const double error = made->model.fx / session.truth.fx - 1;
  const double distortion_px = LargestDistortionError(made->model, session.truth);
  const double in_sigma = std::abs(made->model.fx - session.truth.fx) / made->Sigma(0);
  figures->focal_errors.push_back(std::abs(error));
  figures->mean_errors_px.push_back(made->error_px_mean);
  figures->distortion_errors_px.push_back(distortion_px);
  figures->focal_errors_in_sigma.push_back(in_sigma);
  const bool is_warned = made->status != CalibrationStatus::kGood;
  // Three times the bounds that the 95th percentile and the median are to keep.
  const bool is_bad = std::abs(error) > 0.009 || distortion_px > 0.001 * truth.width_px + 3;
  figures->warned += is_warned;
  figures->silent += is_bad && !is_warned;
  std::printf("f %+.4f %% (sigma %.4f)  mean %.3f px  distortion %.2f px (sigma %.2f)", 100 * error,
              100 * made->Sigma(0) / made->model.fx, made->error_px_mean, distortion_px, made->distortion_sigma_px);
  if (with_opencv) {
    const OpenCvCalibration theirs = CalibrateWithOpenCv(session.input, session.points, OpenCvTarget::kHeights);
    figures->opencv_errors.push_back(std::abs(theirs.fx / session.truth.fx - 1));
    std::printf("  OpenCV f %+.4f %%", 100 * (theirs.fx / session.truth.fx - 1));
  }
  std::printf("%s%s\n", is_warned ? "  WARNED" : "", is_bad ? "  BAD" : "");
  for (const CalibrationWarning& warning : made->warnings) std::printf("     %s\n", warning.text.c_str());
}

void Print(const Figures& f, uint32_t sessions, bool with_opencv) {
  std::printf("focal length: median %.4f %%, 95th percentile %.4f %%, largest %.4f %%\n",
              100 * Quantile(f.focal_errors, 0.5), 100 * Quantile(f.focal_errors, 0.95),
              100 * Quantile(f.focal_errors, 1));
  if (with_opencv) {
    std::printf("OpenCV's:     median %.4f %%, 95th percentile %.4f %%; ours over theirs: %.2f and %.2f\n",
                100 * Quantile(f.opencv_errors, 0.5), 100 * Quantile(f.opencv_errors, 0.95),
                Quantile(f.focal_errors, 0.5) / Quantile(f.opencv_errors, 0.5),
                Quantile(f.focal_errors, 0.95) / Quantile(f.opencv_errors, 0.95));
  }
  std::printf("focal error over its sigma: median %.2f, 95th percentile %.2f (0.67 and 1.96 if all is normal)\n",
              Quantile(f.focal_errors_in_sigma, 0.5), Quantile(f.focal_errors_in_sigma, 0.95));
  std::printf("mean reprojection error: median %.3f px, from %.3f to %.3f\n", Quantile(f.mean_errors_px, 0.5),
              Quantile(f.mean_errors_px, 0), Quantile(f.mean_errors_px, 1));
  std::printf("largest distortion error over the image: median %.3f px, 95th percentile %.3f\n",
              Quantile(f.distortion_errors_px, 0.5), Quantile(f.distortion_errors_px, 0.95));
  std::printf("focal search alone: %u of %u within 5 %%, median %.1f ms, slowest %.1f\n", f.within_5_percent, sessions,
              Quantile(f.search_ms, 0.5), Quantile(f.search_ms, 1));
  std::printf("refused %u, with a warning %u, failed silently %u; median %.0f ms, slowest %.0f\n", f.refused, f.warned,
              f.silent, Quantile(f.calibrate_ms, 0.5), Quantile(f.calibrate_ms, 1));
}

}  // namespace
}  // namespace veduta

int main(int argc, char** argv) {
  uint32_t sessions = 100, first = 0;
  bool with_opencv = true, is_poor = false;
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--no-opencv")) {
      with_opencv = false;
    } else if (!std::strcmp(argv[i], "--poor")) {
      is_poor = true;
      with_opencv = false;  // it takes every id at its word
    } else if (i + 1 < argc && !std::strcmp(argv[i], "--sessions")) {
      sessions = static_cast<uint32_t>(std::atoi(argv[++i]));
    } else if (i + 1 < argc && !std::strcmp(argv[i], "--first")) {
      first = static_cast<uint32_t>(std::atoi(argv[++i]));
    } else {
      std::fprintf(stderr, "usage: veduta-calibration-experiment [--sessions N] [--first N] [--no-opencv] [--poor]\n");
      return 2;
    }
  }
  veduta::Figures figures;
  for (uint32_t i = 0; i < sessions; ++i) veduta::RunSession(first + i, with_opencv, is_poor, &figures);
  veduta::Print(figures, sessions, with_opencv);
}
