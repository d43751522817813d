// SPDX-License-Identifier: Apache-2.0
#pragma once
// The checkerboard of two by two fields at a marker's centre: where its corner is. Both functions
// align a synthetic checkerboard to the image by non-linear least squares. They are pure,
// thread-safe and deterministic.

#include <opencv2/core.hpp>
#include <optional>

#include "engine/camera/markers/ellipse.h"

namespace veduta {

struct BoardPose {
  Eigen::Vector2d center_unit = Eigen::Vector2d::Zero();  // the corner, in the ellipse's unit disc
  double angle_rad = 0;  // of the marker's x axis in the unit disc, up to half a turn
};

// Finds the corner and the axes near the centre of an outline, first coarsely and then finely, in
// the unit disc of the ellipse: right to about a hundredth of the radius. Nothing where there is no
// such pattern. About 0.1 ms.
//
// contrast_gray  the outline's contrast, of which the board must show a fair part.
std::optional<BoardPose> FindBoard(const cv::Mat& gray, const Ellipse& ellipse,
                                   double contrast_gray);

struct BoardFit {
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();
  // Of center_px, as the residuals tell it. DetectMarkers corrects it by what rendered photos show.
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  double blur_px = 0;    // sigma of the edges; the larger one of the two lines'
  double explained = 0;  // the share of the patch's variance that the model explains; at most 1
};

// Finds the corner to a small fraction of a pixel. The model is two blurred, slightly bent lines
// through one point; it is compared with the image's own pixels. Free are the point, both
// directions, both bends (paper bends, and lenses bend lines), both blurs (motion blurs one line
// more than the other), the contrast, the brightness and the light's slope. The product of two
// blurred edges is symmetric about the corner whatever the blur and the tone curve are, so neither
// of them shifts it.
//
// image_from_unit  from the marker's frame to the image, up to half a turn; right to a few px at
//                  the corner.
// blur_px          where the search for the blur starts.
//
// Nothing if the corner lies too near the image's border, or if the fit fails. About 1 ms for large
// markers.
std::optional<BoardFit> AlignBoard(const cv::Mat& gray, const Eigen::Matrix3d& image_from_unit,
                                   double blur_px);

}  // namespace veduta
