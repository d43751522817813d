// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/calibration/chessboard_points.h"

#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veduta {

bool FindChessboard(const std::string& path, cv::Size board, ViewObservations* view) {
  const cv::Mat gray = cv::imread(path, cv::IMREAD_GRAYSCALE);
  if (gray.empty()) return false;
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(gray, board, corners)) return false;
  const cv::TermCriteria until_done(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-4);
  cv::cornerSubPix(gray, corners, {5, 5}, {-1, -1}, until_done);
  view->name = std::filesystem::path(path).filename().string();
  view->size = {static_cast<uint32_t>(gray.cols), static_cast<uint32_t>(gray.rows)};
  for (size_t i = 0; i < corners.size(); ++i) {
    view->points.push_back({static_cast<uint32_t>(i), {corners[i].x, corners[i].y}, 1.});
  }
  return true;
}

}  // namespace veduta
