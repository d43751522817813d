// SPDX-License-Identifier: Apache-2.0
// Goal: the Check() of every options struct of the calibration accepts the defaults and the ends of
//   the ranges that the headers state, and refuses each field outside of its range by name.
// Method: one field at a time out of its bounds, not-a-number and infinity among the values. The
//   number of fields of each struct is fixed by a structured binding: a new field does not compile
//   until this test knows it.
#include <gtest/gtest.h>

#include "engine/camera/calibration/calibrator.h"
#include "engine/camera/calibration/distortion_estimation.h"
#include "engine/camera/calibration/focal_search.h"
#include "engine/camera/calibration/metric_initialization.h"
#include "engine/camera/calibration/observation_choice.h"
#include "engine/camera/calibration/view_tree.h"
#include "tests/engine/camera/option_flips.h"
#include "tools/bench/calibration/synthetic_session.h"

namespace veduta {
namespace {

using testing::ExpectAccepted;
using testing::ExpectRefused;
using testing::kInf;
using testing::kNan;

TEST(Options, PlaneAdjustment) {
  using Options = PlaneAdjustmentOptions;
  [[maybe_unused]] const auto [aspect, planar, plane, center, principal, loss, iterations,
                               tolerance] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectAccepted(&Options::is_aspect_free, {false, true});
  ExpectAccepted(&Options::is_planar, {false, true});
  ExpectRefused(&Options::principal_point_sigma, "principal_point_sigma", {-1., 1.5, kNan, kInf});
  ExpectAccepted(&Options::principal_point_sigma, {0., 0.01, 1.});
  ExpectRefused(&Options::plane_sigma, "plane_sigma", {0., -1., kNan, kInf});
  ExpectRefused(&Options::distortion_center_sigma, "distortion_center_sigma",
                {0., -1., kNan, kInf});
  ExpectRefused(&Options::loss_scale, "loss_scale", {0., -1., kNan, kInf});
  ExpectRefused(&Options::iterations_max, "iterations_max", {0u, 1'000'001u});
  ExpectAccepted(&Options::iterations_max, {1u, 1'000'000u});
  ExpectRefused(&Options::function_tolerance, "function_tolerance", {0., -1., kNan, kInf});
}

TEST(Options, Calibration) {
  using Options = CalibrationOptions;
  [[maybe_unused]] const auto [outlier, points, share, adjustment] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectRefused(&Options::outlier_sigmas, "outlier_sigmas", {2., -1., kNan, kInf});
  ExpectRefused(&Options::photo_points_min, "photo_points_min", {0u, 3u});
  ExpectAccepted(&Options::photo_points_min, {4u});
  ExpectRefused(&Options::photo_share_min, "photo_share_min", {0., 1.01, kNan});
  ExpectAccepted(&Options::photo_share_min, {1.});
  Options nested;
  nested.adjustment.loss_scale = 0;
  EXPECT_EQ(nested.Check().message(),
            "adjustment.loss_scale is 0, but must be finite and more than 0");
}

TEST(Options, Distortion) {
  using Options = DistortionOptions;
  [[maybe_unused]] const auto [start, pairs, center, coefficient, loss] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectAccepted(&Options::extra_pairs, {0u, 100u});
  ExpectRefused(&Options::center_sigma, "center_sigma", {0., -1., kNan, kInf});
  ExpectRefused(&Options::coefficient_sigma, "coefficient_sigma", {0., -1., kNan, kInf});
  ExpectRefused(&Options::loss_scale, "loss_scale", {0., -1., kNan, kInf});
  for (const auto& [name, start] : {std::pair("start.center.x", InverseDistortion{{kNan, 0}}),
                                    {"start.center.y", {{0, kInf}}},
                                    {"start.k1", {{0, 0}, kNan}},
                                    {"start.k2", {{0, 0}, 0, kNan}}}) {
    Options options;
    options.start = start;
    EXPECT_NE(options.Check().message().find(name), std::string::npos) << name;
  }
}

TEST(Options, FocalSearch) {
  using Options = FocalSearchOptions;
  [[maybe_unused]] const auto [low, high, steps] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectRefused(&Options::focal_min, "focal_min", {0., -1., kNan, kInf});
  ExpectRefused(&Options::focal_max, "focal_max", {0.3, 0.1, -1., kNan, kInf});
  ExpectRefused(&Options::step_count, "step_count", {0u, 7u, 10'001u});
  ExpectAccepted(&Options::step_count, {8u, 10'000u});
}

TEST(Options, Metric) {
  using Options = MetricOptions;
  [[maybe_unused]] const auto [error, count, share] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectRefused(&Options::error_max, "error_max", {0., -1., kNan, kInf});
  ExpectRefused(&Options::agreeing_count_min, "agreeing_count_min", {0u, 5u});
  ExpectAccepted(&Options::agreeing_count_min, {6u});
  ExpectRefused(&Options::agreeing_share_min, "agreeing_share_min", {0., 1.01, kNan});
  ExpectAccepted(&Options::agreeing_share_min, {1.});
}

TEST(Options, ViewTree) {
  using Options = ViewTreeOptions;
  [[maybe_unused]] const auto [count, full, error] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectRefused(&Options::common_count_min, "common_count_min", {0u, 5u});
  ExpectAccepted(&Options::common_count_min, {6u, 30u});
  ExpectRefused(&Options::common_count_full, "common_count_full", {0u, 7u});
  ExpectAccepted(&Options::common_count_full, {8u});
  ExpectRefused(&Options::error_max, "error_max", {0., -1., kNan, kInf});
}

TEST(Options, Choice) {
  using Options = ChoiceOptions;
  [[maybe_unused]] const auto [points, share] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectRefused(&Options::photo_points_min, "photo_points_min", {0u, 3u});
  ExpectRefused(&Options::photo_share_min, "photo_share_min", {0., 1.01, kNan});
}

TEST(Options, TheStepsLookAtThem) {
  const SyntheticSession session = MakeSession({.photo_count = 3, .seed = 16});
  CalibrationOptions calibration;
  calibration.photo_share_min = 1.5;
  EXPECT_NE(CalibrateCamera(session.input, calibration).status().message().find("photo_share_min"),
            std::string::npos);
  DistortionOptions distortion;
  distortion.loss_scale = 0;
  ViewTree tree;
  EXPECT_NE(EstimateDistortion({}, distortion, &tree).status().message().find("loss_scale"),
            std::string::npos);
  // These steps return no Status: what the caller gives them has been checked.
  ViewTreeOptions narrow;
  narrow.error_max = 0;
  EXPECT_DEATH(GrowViewTree({}, narrow), "error_max");
  FocalSearchOptions search;
  search.step_count = 0;
  EXPECT_DEATH(SearchFocalLength({}, search), "step_count");
}

}  // namespace
}  // namespace veduta
