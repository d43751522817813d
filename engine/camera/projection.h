// SPDX-License-Identifier: Apache-2.0
#pragma once
// From pixels to rays and back. The camera model and its conventions: CameraModel in
// storage/model/camera.h.
//
// Two kinds of pixels. `distorted_px` lie in the photo as it was taken; `undistorted_px` lie in the
// image that UndistortTable makes of it, a pinhole image with the same size and the same fx, fy,
// cx, cy. All of these functions are pure and thread-safe; those that take a model expect one that
// CheckCamera accepts.

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "storage/base/status.h"
#include "storage/model/camera.h"

namespace veduta {

inline constexpr uint32_t kCameraSideMax = 65535;  // px

// Whether a model can be used: sizes in [1, 65535] px; everything finite; focal lengths within
// [0.01, 1000] times the longer side (179 to 0.06 degrees of view); both centres at most one
// image's size outside of the image; and a distortion that neither folds over within the image nor
// leaves a part of the photo that no ray reaches, so that DistortPixel and UndistortPixel are
// inverse to each other over the whole image. kInvalidArgument names the field and its value.
Status CheckCamera(const CameraModel& model);

// False for an exact pinhole: the two kinds of pixels are the same.
bool IsDistorted(const CameraModel& model);

// Where the ray of an undistorted pixel meets the photo: x_d = c + (x - c)(1 + k1 r^2 + k2 r^4), r
// = |x - c|.
Eigen::Vector2d DistortPixel(const CameraModel& model, const Eigen::Vector2d& undistorted_px);

// The inverse, by Newton's method kept within a bracket, to better than 1e-10 in normalised
// coordinates. Nothing if no undistorted pixel before the fold of the distortion is mapped here,
// which cannot happen inside the photo.
std::optional<Eigen::Vector2d> UndistortPixel(const CameraModel& model,
                                              const Eigen::Vector2d& distorted_px);

// Whether the undistorted image shows the photo, and not the black around it, everywhere within
// `margin_px` (>= 0, undistorted px) of this place. Features for which it is false may be corners
// of the artificial border; drop them. Places beyond the edge of the undistorted image itself do
// not count, so it is true all over an undistorted camera.
bool IsInsidePhoto(const CameraModel& model, const Eigen::Vector2d& undistorted_px,
                   double margin_px);

// The unit vector, camera frame, of the ray through an undistorted pixel.
Eigen::Vector3d BearingFromPixel(const CameraModel& model, const Eigen::Vector2d& undistorted_px);

// The undistorted pixel that sees along `ray_in_cam` (any length > 0); nothing for rays that do not
// point forward.
std::optional<Eigen::Vector2d> PixelFromBearing(const CameraModel& model,
                                                const Eigen::Vector3d& ray_in_cam);

// The focal length and offsets of normalised coordinates, x = (u - cx) / fx and y = (v - cy) / fy.
inline Eigen::Vector2d NormalizedFromPixel(const CameraModel& model, const Eigen::Vector2d& px) {
  return {(px.x() - model.cx) / model.fx, (px.y() - model.cy) / model.fy};
}
inline Eigen::Vector2d PixelFromNormalized(const CameraModel& model, const Eigen::Vector2d& x) {
  return {model.fx * x.x() + model.cx, model.fy * x.y() + model.cy};
}

}  // namespace veduta
