// SPDX-License-Identifier: Apache-2.0
#pragma once
// The pose of a photo whose camera is not known, with its focal length and radial distortion, from
// points that it sees (R24).

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/mapping/resection.h"
#include "storage/base/status.h"
#include "storage/base/transform.h"
#include "storage/model/camera.h"

namespace veduta {

// What is unknown of a lens: the logarithm of the focal length, k1, k2, and by how much of the
// focal length the principal point, which is the centre of distortion as well, lies right of the
// photo's middle, and below it.
inline constexpr int kLensUnknowns = 5;
// Standard deviations by which all but the first are drawn to 0, as by an observation each: lenses
// of phones and cameras distort little, and their axes meet the photo near its middle, within some
// 0.7 % of the longer side. Chosen by hand; not measured.
Eigen::Vector4d LensDeviations(const CameraModel& camera);

struct UnknownCameraOptions {
  // What counts as an inlier, and how many there must be. There are more unknowns than in a pose
  // alone, so more inliers are asked for; but a smaller share of the correspondences, which are
  // gathered from many images that look alike: one of 19 photos of castle-P19 has between 5 and 15
  // % of 956. Chosen by hand; not measured otherwise.
  ResectionOptions resection = {
      .inlier_count_min = 30, .inlier_share_min = 0.05, .samples_max = 800};
  // > 0. The shortest and the longest focal length that is tried, over the longer side of the
  // photo: 110 and 14 degrees of view.
  double focal_share_min = 0.35, focal_share_max = 4;
  // >= 2. Focal lengths that are tried, evenly in the logarithm: each is then within 8 % of one.
  // Chosen by hand; not measured.
  uint32_t focal_count = 18;
  // >= 0. What the photo itself tells (FocalShareOf), over its longer side; 0 where it tells
  // nothing. Focal lengths around it are tried first, with more samples, and fewer inliers do there
  // (`told`): what is left to be found is little more than a pose. It means no more than that:
  // where so few are found, all focal lengths are tried, and those that explain most are taken.
  double told_focal_share = 0;
  ResectionOptions told = {.inlier_count_min = 20, .inlier_share_min = 0.03, .samples_max = 4000};

  Status Check() const;
};

struct UnknownCameraResection {
  ResectionOutcome outcome = ResectionOutcome::kTooFewMatches;
  Rigid3 cam_from_world;          // in the scale of the points
  CameraModel camera;             // square pixels; both centres in one place
  std::vector<uint32_t> inliers;  // ascending indices of the inputs
};

// Tries P3P (Kneip 2011) with each of the focal lengths and a few distortions inside one RANSAC,
// and refines pose and lens together on what agrees, by robust Levenberg-Marquardt.
//
// x_px    where the features lie in the photo as it was taken, most trustworthy first.
// points  where the same features lie in the reconstruction; one feature may have several.
//
// Whether what is seen determines the focal length is for the caller to ask (RefineUnknownCamera's
// covariance). Deterministic in its inputs. Thread-safe. O(samples * focal lengths * N).
UnknownCameraResection ResectUnknownCamera(std::span<const Eigen::Vector2d> x_px,
                                           std::span<const Eigen::Vector3d> points,
                                           uint32_t width_px, uint32_t height_px, uint64_t seed,
                                           const UnknownCameraOptions& options);

// A pose and a camera, and how sure they are.
struct RefinedCamera {
  Rigid3 cam_from_world;
  CameraModel camera;
  // Of (omega, t) and the lens, with x_cam = exp([omega]x) R X + T + t; the points are held. For
  // independent errors as large as those that were found. Infinite on the diagonal where nothing
  // determines them.
  Eigen::Matrix<double, 6 + kLensUnknowns, 6 + kLensUnknowns> covariance;

  // Standard deviation of the focal length over itself.
  double FocalDeviationShare() const { return std::sqrt(covariance(6, 6)); }
};

// Minimises the Cauchy-weighted squared reprojection errors, of `scale_px`, over pose and lens. The
// camera has square pixels, and both centres in one place. A focal length that is told (> 0) counts
// like an observation of one pixel at 4 % of itself, which is what makers round and count
// differently by.
RefinedCamera RefineUnknownCamera(const Rigid3& cam_from_world, const CameraModel& camera,
                                  std::span<const Eigen::Vector2d> x_px,
                                  std::span<const Eigen::Vector3d> points, double scale_px,
                                  double told_focal_px = 0);

}  // namespace veduta
