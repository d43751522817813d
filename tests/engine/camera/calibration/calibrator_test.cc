// SPDX-License-Identifier: Apache-2.0
// Goal: a calibration from points alone is as good as the table of issue 4 asks, gross errors
//   are left out with a word, and what the photos cannot tell is an error or a warning that
//   says what to photograph.
// Method: synthetic sessions of known truth (tools/calibration), whole and spoilt in one way
//   each.
#include "engine/camera/calibration/calibrator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/camera/projection.h"
#include "tools/calibration/synthetic_session.h"

namespace veduta {
namespace {

bool Warns(const Calibration& made, CalibrationAdvice kind, const std::string& words = "") {
  return std::any_of(made.warnings.begin(), made.warnings.end(), [&](const CalibrationWarning& w) {
    return w.kind == kind && w.text.find(words) != std::string::npos;
  });
}

double FocalError(const Calibration& made, const SyntheticSession& session) {
  return std::abs(made.model.fx / session.truth.fx - 1);
}

std::vector<std::string> LeftOut(const Calibration& made) {
  std::vector<std::string> names;
  for (const CalibrationPhoto& photo : made.photos) {
    if (!photo.why_left_out.empty()) names.push_back(photo.name);
  }
  return names;
}

TEST(Calibrator, TenSessions) {
  std::vector<double> focal, distortion;
  for (uint32_t i = 0; i < 10; ++i) {
    const SyntheticSession session = MakeSession(ExperimentOptions(i));
    const auto made = CalibrateCamera(session.input);
    ASSERT_TRUE(made.ok()) << i << ": " << made.status().message();
    EXPECT_EQ(made->status, CalibrationStatus::kGood) << i << ": " << made->warnings.front().text;
    EXPECT_TRUE(LeftOut(*made).empty()) << i;
    EXPECT_TRUE(CheckCamera(made->model).ok());
    EXPECT_FALSE(made->is_aspect_free) << i;
    focal.push_back(FocalError(*made, session));
    EXPECT_LT(std::abs(made->model.fx - session.truth.fx), 4 * made->Sigma(0)) << i;
    EXPECT_LT(std::abs(made->model.cx - session.truth.cx), 4 * made->Sigma(2)) << i;
    distortion.push_back(LargestDistortionError(made->model, session.truth));
    EXPECT_LT(made->error_px_mean, 1.4 * ExperimentOptions(i).noise_px)
        << i;  // a Rayleigh's mean is 1.25 sigma
  }
  std::sort(focal.begin(), focal.end());
  std::sort(distortion.begin(), distortion.end());
  EXPECT_LT(focal[5], 0.0003);  // the issue asks 0.001 of the median
  EXPECT_LT(focal[9], 0.001);   // and 0.003 of the 95th percentile
  EXPECT_LT(distortion[5], 0.4);
}

TEST(Calibrator, TheSameTwice) {
  const SyntheticSession session = MakeSession(ExperimentOptions(2));
  const auto once = CalibrateCamera(session.input), again = CalibrateCamera(session.input);
  ASSERT_TRUE(once.ok() && again.ok());
  EXPECT_EQ(once->model, again->model);
}

TEST(Calibrator, PixelsThatAreNotSquare) {
  SyntheticSession session = MakeSession({.seed = 5});
  for (ViewObservations& view : session.input.views) {
    for (PointObservation& p : view.points) p.px.y() *= 1.01;
    view.size.height_px = 1722;
  }
  const auto made = CalibrateCamera(session.input);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_TRUE(made->is_aspect_free);
  EXPECT_NEAR(made->model.fy / made->model.fx, 1.01, 0.001);
}

TEST(Calibrator, ASheetThatMoved) {
  SyntheticSession session = MakeSession({.focal_per_width = 1, .photo_count = 14, .seed = 7});
  const SyntheticSession whole = session;
  // Markers 24 to 29, sheet 5, lie 15 px to the right, and less up, in the last six photos.
  size_t moved = 0;
  for (size_t v = 8; v < 14; ++v) {
    for (PointObservation& p : session.input.views[v].points) {
      if (p.id >= 24 && p.id < 30) p.px += Eigen::Vector2d(15, -9), ++moved;
    }
  }
  ASSERT_GT(moved, 10u);
  const auto made = CalibrateCamera(session.input);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_LT(FocalError(*made, session), 0.001);
  EXPECT_TRUE(LeftOut(*made).empty());
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kPointsLeftOut, "25, 26, 27, 28, 29"));
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kPointsLeftOut, "moved"));
  for (const CalibrationResidual& r : made->residuals) {
    EXPECT_FALSE(r.is_used && r.photo >= 8 && r.id >= 24 && r.id < 30) << r.photo << " " << r.id;
  }
}

TEST(Calibrator, MisreadIds) {
  SyntheticSession session = MakeSession({.seed = 8});
  // In every photo two ids changed places.
  for (ViewObservations& view : session.input.views)
    std::swap(view.points[3].px, view.points[view.points.size() / 2].px);
  const auto made = CalibrateCamera(session.input);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_LT(FocalError(*made, session), 0.001);
  EXPECT_TRUE(LeftOut(*made).empty());
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kPointsLeftOut));
}

TEST(Calibrator, AnIdSeenTwiceIsNotUsed) {
  SyntheticSession session = MakeSession({.seed = 9});
  session.input.views[0].points.push_back(session.input.views[0].points[0]);
  session.input.views[0].points.back().px.x() += 100;
  const auto made = CalibrateCamera(session.input);
  ASSERT_TRUE(made.ok());
  const uint32_t id = session.input.views[0].points[0].id;
  EXPECT_TRUE(
      std::none_of(made->residuals.begin(), made->residuals.end(),
                   [&](const CalibrationResidual& r) { return r.photo == 0 && r.id == id; }));
}

TEST(Calibrator, APhotoOfSomethingElse) {
  SyntheticSession session = MakeSession({.photo_count = 10, .seed = 10});
  // Another arrangement of the sheets.
  session.input.views[4].points =
      MakeSession({.photo_count = 10, .seed = 99}).input.views[4].points;
  const auto made = CalibrateCamera(session.input);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_EQ(LeftOut(*made), std::vector<std::string>{"photo5"});
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kPhotoLeftOut, "photo5"));
  EXPECT_LT(FocalError(*made, session), 0.001);
}

// Fourteen photos, of which those listed were taken at `zoom` times the focal length of the others.
SyntheticSession SessionOfTwoZooms(double zoom, const std::vector<size_t>& zoomed_views) {
  SessionOptions options{
      .focal_per_width = 1, .principal_offset = 0, .photo_count = 14, .seed = 11};
  SyntheticSession session = MakeSession(options);
  options.focal_per_width = zoom;
  const SyntheticSession other = MakeSession(options);
  for (const size_t v : zoomed_views) session.input.views[v].points = other.input.views[v].points;
  return session;
}

TEST(Calibrator, TwoPhotosAtAnotherZoom) {
  const SyntheticSession session = SessionOfTwoZooms(1.15, {3, 9});
  const auto made = CalibrateCamera(session.input);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_EQ(LeftOut(*made), (std::vector<std::string>{"photo4", "photo10"}));
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kPhotoLeftOut, "zoom"));
  EXPECT_LT(FocalError(*made, session), 0.001);
}

TEST(Calibrator, HalfThePhotosAtAnotherZoom) {
  const SyntheticSession session = SessionOfTwoZooms(1.3, {0, 2, 4, 6, 8, 10, 12});
  const auto made = CalibrateCamera(session.input);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.status().message().find("several cameras or zooms"), std::string::npos)
      << made.status().message();
}

TEST(Calibrator, PhotosOfTwoSizes) {
  SyntheticSession session = MakeSession({.seed = 12});
  session.input.views[5].size = {1600, 1200};
  auto made = CalibrateCamera(session.input);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.status().message().find("two cameras"), std::string::npos);
  session.input.views[5].size = {1704, 2272};
  made = CalibrateCamera(session.input);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.status().message().find("same way round"), std::string::npos);
}

TEST(Calibrator, NoTilt) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const SyntheticSession session =
        MakeSession({.tilt_deg_min = 0, .tilt_deg_max = 1.5, .seed = seed});
    const auto made = CalibrateCamera(session.input);
    if (!made.ok()) {
      EXPECT_NE(made.status().message().find("Tilt the camera"), std::string::npos)
          << made.status().message();
    } else {
      EXPECT_TRUE(Warns(*made, CalibrationAdvice::kFocalLength, "tilt the camera"))
          << seed << " " << made->model.fx;
    }
  }
}

TEST(Calibrator, OneDistanceAndLittleTilt) {
  const SyntheticSession session = MakeSession({.photo_count = 8,
                                                .noise_px = 0.3,
                                                .tilt_deg_min = 3,
                                                .tilt_deg_max = 6,
                                                .distance_ratio = 1,
                                                .seed = 3});
  const auto made = CalibrateCamera(session.input);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kFocalLength));
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kOneDistance));
}

// The same photos with the markers alone that lie within so much of the middle.
CalibrationInput Cropped(CalibrationInput input, double across_px, double down_px) {
  for (ViewObservations& view : input.views) {
    const double x = view.size.width_px / 2., y = view.size.height_px / 2.;
    std::erase_if(view.points, [&](const PointObservation& p) {
      return std::abs(p.px.x() - x) > across_px || std::abs(p.px.y() - y) > down_px;
    });
  }
  return input;
}

TEST(Calibrator, MarkersInTheMiddleAlone) {
  const SyntheticSession session = MakeSession(
      {.focal_per_width = 0.8, .distortion_at_corner = -0.1, .noise_px = 0.3, .seed = 4});
  const auto less = CalibrateCamera(Cropped(session.input, 700, 600));
  ASSERT_TRUE(less.ok()) << less.status().message();
  EXPECT_EQ(less->status, CalibrationStatus::kUncertain);
  EXPECT_TRUE(Warns(*less, CalibrationAdvice::kDistortion, "photograph the corners"));
  const auto least = CalibrateCamera(Cropped(session.input, 450, 400));
  ASSERT_FALSE(least.ok());
  EXPECT_NE(least.status().message().find("Photograph the corners"), std::string::npos)
      << least.status().message();
}

TEST(Calibrator, TooFewPhotosOrPoints) {
  SyntheticSession session = MakeSession({.seed = 13});
  CalibrationInput input = session.input;
  input.views.resize(2);
  auto made = CalibrateCamera(input);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.status().message().find("too few"), std::string::npos);

  input.views = {session.input.views.begin(), session.input.views.begin() + 5};
  made = CalibrateCamera(input);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kFewPhotos, "only 5 photos"));

  for (size_t v = 0; v < input.views.size(); ++v) {  // nothing in common
    for (PointObservation& p : input.views[v].points) p.id += static_cast<uint32_t>(1000 * v);
  }
  made = CalibrateCamera(input);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.status().message().find("points in common"), std::string::npos);
  for (ViewObservations& view : input.views) view.points.clear();
  EXPECT_FALSE(CalibrateCamera(input).ok());
}

TEST(Calibrator, PhotosWithMuchBlur) {
  SyntheticSession session = MakeSession({.photo_count = 10, .noise_px = 3, .seed = 14});
  const auto made = CalibrateCamera(session.input);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_TRUE(Warns(*made, CalibrationAdvice::kResidual, "in focus"));
}

TEST(Calibrator, NumbersThatAreNone) {
  SyntheticSession session = MakeSession({.seed = 15});
  session.input.views[3].points[2].px.x() = std::nan("");
  auto made = CalibrateCamera(session.input);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.status().message().find("photo4"), std::string::npos);
  session.input.views[3].points[2].px.x() = 5;
  session.input.views[3].points[2].sigma_px = 0;
  EXPECT_FALSE(CalibrateCamera(session.input).ok());
}

}  // namespace
}  // namespace veduta
