// SPDX-License-Identifier: Apache-2.0
#pragma once
// The checkerboard of two by two at a marker's centre: where its corner is. Both functions align a
// synthetic one to the image by non-linear least squares. Pure, thread-safe, deterministic.

#include <opencv2/core.hpp>
#include <optional>

#include "engine/camera/markers/ellipse.h"

namespace veduta {

struct BoardPose {
  Eigen::Vector2d center_unit =
      Eigen::Vector2d::Zero();  // of the corner, in the ellipse's unit disc
  double angle_rad = 0;         // of the marker's x axis there, up to half a turn
};

// Finds corner and axes near the centre of an outline, coarse to fine, in the unit disc of the
// ellipse: good to about a hundredth of the radius. Nothing where there is no such pattern. About
// 0.1 ms.
//
// contrast_gray  of the outline; the board must show a fair part of it.
std::optional<BoardPose> FindBoard(const cv::Mat& gray, const Ellipse& ellipse,
                                   double contrast_gray);

struct BoardFit {
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 =
      Eigen::Matrix2d::Zero();  // from the residuals: of the model, not yet calibrated
  double blur_px = 0;           // sigma of the edges, the larger of the two lines'
  double explained = 0;         // part of the patch's variance that the model explains, up to 1
};

// The corner to a small fraction of a pixel: two blurred, slightly bent lines through one point,
// over the image's own pixels. Free are the point, both directions, both bends (bent paper and
// distorted lenses), both blurs (a smear blurs one line more), and contrast, brightness and the
// light's slope. The blurred product of two edges is symmetric about the corner whatever the blur
// and the tone curve, so these do not shift it.
//
// image_from_unit  the marker's frame to the image, up to half a turn; right to a few px at the
// corner. blur_px          to start with. Nothing if the corner lies too near the image's border,
// or if the fit fails. About 1 ms for large markers.
std::optional<BoardFit> AlignBoard(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit,
                                   double blur_px);

}  // namespace veduta
