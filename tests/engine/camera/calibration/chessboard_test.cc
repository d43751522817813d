// SPDX-License-Identifier: Apache-2.0
// Goal: real photos of a real board give the camera that OpenCV finds when it, too, does not
//   trust the board's print.
// Method: the 13 left photos of shared/data/chessboard, OpenCV's corners, OpenCV's
//   calibrateCamera and calibrateCameraRO.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "engine/camera/calibration/calibrator.h"
#include "tools/bench/calibration/chessboard_points.h"
#include "tools/bench/calibration/opencv_calibration.h"

namespace veduta {
namespace {

TEST(Chessboard, AsOpenCvWithAFreeGrid) {
  const std::filesystem::path folder = std::filesystem::path(VEDUTA_TEST_DATA) / "chessboard";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no real photographs here";
  std::set<std::string> photos;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with("left")) photos.insert(entry.path().string());
  }
  CalibrationInput input;
  for (const std::string& photo : photos) {
    ASSERT_TRUE(FindChessboard(photo, {9, 6}, &input.views.emplace_back())) << photo;
  }
  ASSERT_EQ(input.views.size(), 13u);
  std::vector<Eigen::Vector3d> grid;
  for (int i = 0; i < 54; ++i) grid.emplace_back(i % 9, i / 9, 0);
  const OpenCvCalibration exact = CalibrateWithOpenCv(input, grid, OpenCvTarget::kFlat);
  const OpenCvCalibration free = CalibrateWithOpenCv(input, grid, OpenCvTarget::kFree, 9);
  const auto ours = CalibrateCamera(input);
  ASSERT_TRUE(ours.ok()) << ours.status().message();
  EXPECT_NEAR(ours->model.fx / exact.fx, 1, 0.01);
  EXPECT_NEAR(ours->model.fx / free.fx, 1, 0.003);
  EXPECT_NEAR(ours->model.cx, free.cx, 2);
  EXPECT_NEAR(ours->model.cy, free.cy, 2);
  EXPECT_LT(ours->error_px_rms, 1.05 * free.error_px_rms);  // both count the length of the residual
  EXPECT_LT(ours->error_px_rms, 0.75 * exact.error_px_rms);
  EXPECT_FALSE(ours->is_aspect_free);
}

}  // namespace
}  // namespace veduta
