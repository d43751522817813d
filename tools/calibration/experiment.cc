// SPDX-License-Identifier: Apache-2.0
// Synthetic calibration sessions of known truth: how far off the calibration is, beside OpenCV's,
// which is told where the points lie. Prints one line for each session, and the figures of all.
// usage: veduta-calibration-experiment [--sessions N] [--first N] [--no-opencv] [--poor]
//                                      [--rendered [--threads N] [--keep FOLDER]]
// Sessions are of points only. With --rendered they are markers found in rendered photos, which
// --keep writes to a folder. --poor makes sessions that leave much open; what counts there is that
// none of them fails silently.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "engine/camera/calibration/calibrator.h"
#include "engine/camera/calibration/distortion_estimation.h"
#include "engine/camera/calibration/focal_search.h"
#include "engine/camera/calibration/scene_initialization.h"
#include "tools/calibration/opencv_calibration.h"
#include "tools/calibration/rendered_session.h"
#include "tools/calibration/synthetic_session.h"

namespace veduta {
namespace {

using floor::Percentile;

double MillisecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

struct Arguments {
  uint32_t sessions = 100, first = 0, threads = 1;
  bool with_opencv = true, is_poor = false, is_rendered = false;
  std::string keep;
};

struct Figures {
  std::vector<double> focal_errors, opencv_errors, search_ms, calibrate_ms, mean_errors_px,
      distortion_errors_px, focal_errors_in_sigma;
  uint32_t within_5_percent = 0, refused = 0, warned = 0, silent = 0, photos = 0,
           useless_photos = 0;
  std::vector<floor::PhotoOutcome> found;  // of rendered photos
};

SyntheticSession Render(const Arguments& arguments, uint32_t index, ThreadPool* pool,
                        Figures* figures) {
  RenderedSession rendered = RenderSession(index, arguments.keep, pool);
  figures->photos += static_cast<uint32_t>(rendered.found.size());
  figures->useless_photos += rendered.useless_count;
  figures->found.insert(figures->found.end(), rendered.found.begin(), rendered.found.end());
  return std::move(rendered.session);
}

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

double MedianSigmaPx(const CalibrationInput& input) {
  std::vector<double> sigmas;
  for (const ViewObservations& view : input.views) {
    for (const PointObservation& o : view.points) sigmas.push_back(o.sigma_px);
  }
  return Percentile(std::move(sigmas), 0.5);
}

void RunSession(uint32_t index, const SyntheticSession& session, bool with_opencv,
                Figures* figures) {
  const CameraModel& truth = session.truth;
  std::printf("%3u  f/w %.2f  %2zu photos  noise %.2f  k1 %+.3f  ", index,
              truth.fx / truth.width_px, session.input.views.size(), MedianSigmaPx(session.input),
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
  // Three times the bounds that the 95th percentile of the focal length's error and the median of
  // the distortion's error must keep.
  const bool is_bad = std::abs(error) > 0.009 || distortion_px > 0.001 * truth.width_px + 3;
  figures->warned += is_warned;
  figures->silent += is_bad && !is_warned;
  std::printf("f %+.4f %% (sigma %.4f)  mean %.3f px  distortion %.2f px (sigma %.2f)", 100 * error,
              100 * made->Sigma(0) / made->model.fx, made->error_px_mean, distortion_px,
              made->distortion_sigma_px);
  if (with_opencv) {
    const OpenCvCalibration theirs =
        CalibrateWithOpenCv(session.input, session.points, OpenCvTarget::kHeights);
    figures->opencv_errors.push_back(std::abs(theirs.fx / session.truth.fx - 1));
    std::printf("  OpenCV f %+.4f %%", 100 * (theirs.fx / session.truth.fx - 1));
  }
  std::printf("%s%s\n", is_warned ? "  WARNED" : "", is_bad ? "  BAD" : "");
  for (const CalibrationWarning& warning : made->warnings)
    std::printf("     %s\n", warning.text.c_str());
  std::fflush(stdout);
}

void Print(const Figures& f, uint32_t sessions, bool with_opencv) {
  std::printf("focal length: median %.4f %%, 95th percentile %.4f %%, largest %.4f %%\n",
              100 * Percentile(f.focal_errors, 0.5), 100 * Percentile(f.focal_errors, 0.95),
              100 * Percentile(f.focal_errors, 1));
  if (with_opencv) {
    std::printf(
        "OpenCV's:     median %.4f %%, 95th percentile %.4f %%; ours over theirs: %.2f and %.2f\n",
        100 * Percentile(f.opencv_errors, 0.5), 100 * Percentile(f.opencv_errors, 0.95),
        Percentile(f.focal_errors, 0.5) / Percentile(f.opencv_errors, 0.5),
        Percentile(f.focal_errors, 0.95) / Percentile(f.opencv_errors, 0.95));
  }
  std::printf(
      "focal error over its sigma: median %.2f, 95th percentile %.2f (0.67 and 1.96 if all is "
      "normal)\n",
      Percentile(f.focal_errors_in_sigma, 0.5), Percentile(f.focal_errors_in_sigma, 0.95));
  std::printf("mean reprojection error: median %.3f px, from %.3f to %.3f\n",
              Percentile(f.mean_errors_px, 0.5), Percentile(f.mean_errors_px, 0),
              Percentile(f.mean_errors_px, 1));
  std::printf("largest distortion error over the image: median %.3f px, 95th percentile %.3f\n",
              Percentile(f.distortion_errors_px, 0.5), Percentile(f.distortion_errors_px, 0.95));
  std::printf("focal search alone: %u of %u within 5 %%, median %.1f ms, slowest %.1f\n",
              f.within_5_percent, sessions, Percentile(f.search_ms, 0.5),
              Percentile(f.search_ms, 1));
  std::printf("refused %u, with a warning %u, failed silently %u; median %.0f ms, slowest %.0f\n",
              f.refused, f.warned, f.silent, Percentile(f.calibrate_ms, 0.5),
              Percentile(f.calibrate_ms, 1));
  if (f.photos == 0) return;
  std::vector<double> diameters_px;
  for (const floor::PhotoOutcome& photo : f.found) {
    for (const floor::MarkerOutcome& marker : photo.markers)
      diameters_px.push_back(marker.truth.diameter_px);
  }
  std::printf(
      "photos without use: %u of %u; markers %.0f px across (5th percentile %.0f); found of those "
      "whole in view:\n",
      f.useless_photos, f.photos, Percentile(diameters_px, 0.5), Percentile(diameters_px, 0.05));
  floor::PrintOutcome("", f.found, std::nullopt);
}

bool Parse(int argc, char** argv, Arguments* a) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    const bool has_value = i + 1 < argc;
    if (name == "--no-opencv") {
      a->with_opencv = false;
    } else if (name == "--poor") {
      a->is_poor = true;
      a->with_opencv = false;  // OpenCV would believe every misread id
    } else if (name == "--rendered") {
      a->is_rendered = true;
    } else if (has_value && name == "--keep") {
      a->keep = argv[++i];
    } else if (has_value && (name == "--sessions" || name == "--first" || name == "--threads")) {
      uint32_t* const value = name == "--sessions" ? &a->sessions
                              : name == "--first"  ? &a->first
                                                   : &a->threads;
      *value = static_cast<uint32_t>(std::atoi(argv[++i]));
    } else {
      return false;
    }
  }
  return a->threads >= 1 && a->threads <= 256 && !(a->is_poor && a->is_rendered);
}

int Run(const Arguments& arguments) {
  ThreadPool pool(arguments.threads - 1);
  Figures figures;
  for (uint32_t i = arguments.first; i < arguments.first + arguments.sessions; ++i) {
    const SyntheticSession session = arguments.is_rendered ? Render(arguments, i, &pool, &figures)
                                     : arguments.is_poor   ? MakePoorSession(i)
                                                           : MakeSession(ExperimentOptions(i));
    RunSession(i, session, arguments.with_opencv, &figures);
  }
  Print(figures, arguments.sessions, arguments.with_opencv);
  return 0;
}

}  // namespace
}  // namespace veduta

int main(int argc, char** argv) {
  veduta::Arguments arguments;
  if (veduta::Parse(argc, argv, &arguments)) return veduta::Run(arguments);
  std::fprintf(stderr,
               "usage: veduta-calibration-experiment [--sessions N] [--first N] [--no-opencv] "
               "[--poor | --rendered [--threads N] [--keep FOLDER]]\n");
  return 2;
}
