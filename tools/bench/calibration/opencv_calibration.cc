// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/calibration/opencv_calibration.h"

#include <opencv2/calib3d.hpp>

namespace veduta {

OpenCvCalibration CalibrateWithOpenCv(const CalibrationInput& input,
                                      const std::vector<Eigen::Vector3d>& points,
                                      OpenCvTarget target, int grid_columns) {
  std::vector<std::vector<cv::Point3f>> flat, whole;
  std::vector<std::vector<cv::Point2f>> seen;
  for (const ViewObservations& view : input.views) {
    flat.emplace_back();
    whole.emplace_back();
    seen.emplace_back();
    for (const PointObservation& o : view.points) {
      const Eigen::Vector3f p = points[o.id].cast<float>();
      flat.back().emplace_back(p.x(), p.y(), 0.f);
      whole.back().emplace_back(p.x(), p.y(), p.z());
      seen.back().emplace_back(static_cast<float>(o.px.x()), static_cast<float>(o.px.y()));
    }
  }
  const ImageSize size = input.views.front().size;
  const cv::Size cv_size(static_cast<int>(size.width_px), static_cast<int>(size.height_px));
  const cv::TermCriteria until_done(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-10);
  cv::Mat k = cv::Mat::eye(3, 3, CV_64F), distortion;
  std::vector<cv::Mat> rotations, translations;
  OpenCvCalibration made;
  if (target == OpenCvTarget::kFree) {
    cv::Mat moved;
    made.error_px_rms = cv::calibrateCameraRO(flat, seen, cv_size, grid_columns - 1, k, distortion,
                                              rotations, translations, moved, 0, until_done);
  } else {
    made.error_px_rms = cv::calibrateCamera(flat, seen, cv_size, k, distortion, rotations,
                                            translations, 0, until_done);
  }
  if (target == OpenCvTarget::kHeights) {
    made.error_px_rms =
        cv::calibrateCamera(whole, seen, cv_size, k, distortion, rotations, translations,
                            cv::CALIB_USE_INTRINSIC_GUESS, until_done);
  }
  made.fx = k.at<double>(0, 0);
  made.fy = k.at<double>(1, 1);
  made.cx = k.at<double>(0, 2);
  made.cy = k.at<double>(1, 2);
  made.distortion.assign(distortion.begin<double>(), distortion.end<double>());
  return made;
}

}  // namespace veduta
