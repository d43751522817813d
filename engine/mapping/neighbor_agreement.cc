// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/neighbor_agreement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/matching/two_view.h"
#include "storage/base/angle.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Whether the point that `feature` of `from` has, if it has one, falls near `seen` of `view`.
bool FallsNear(const CityMap& map, const MapImage& from, FeatureIndex feature, const MapImage& view,
               FeatureIndex seen, double error_px_max) {
  const PointId id = from.points[feature];
  const PointRecord* const point = id.valid() ? map.FindPoint(id) : nullptr;
  return point == nullptr || ReprojectionErrorPx(view.ViewOf(seen), point->position) < error_px_max;
}

// Standard deviation of the places, px, the way it is smallest.
double SpreadPx(std::span<const Eigen::Vector2d> places) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& x : places) mean += x / static_cast<double>(places.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& x : places)
    covariance += (x - mean) * (x - mean).transpose() / static_cast<double>(places.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(solver.eigenvalues()[0], 0.0));
}

// Whether the matches tell little of the rotation between the two.
bool IsNarrow(const MapImage& view, const MapImage& other, std::span<const FeatureMatch> matches,
              double share) {
  std::vector<Eigen::Vector2d> in_view, in_other;
  for (const FeatureMatch& match : matches) {
    const Keypoint &a = view.features->keypoints[match.a], &b = other.features->keypoints[match.b];
    in_view.emplace_back(a.x_px, a.y_px);
    in_other.emplace_back(b.x_px, b.y_px);
  }
  return SpreadPx(in_view) < share * view.width_px || SpreadPx(in_other) < share * other.width_px;
}

// The rotation that the pair by itself has found, by the focal lengths of now: anew from its
// matches where a lens was refined since.
Eigen::Quaterniond RotationOf(const PairMatches& pair, const MapImage& view,
                              const MapImage& other) {
  const double focal_px = view.camera.focal_px(), other_focal_px = other.camera.focal_px();
  const bool is_of_now =
      pair.lens_photo.focal_px == 0 ||
      (pair.lens_photo.focal_px == focal_px && pair.lens_other.focal_px == other_focal_px);
  if (is_of_now) return pair.other_from_photo.rotation;
  std::vector<Eigen::Vector2d> x, x_other;
  for (const FeatureMatch& match : pair.matches) {
    x.push_back(view.camera.Normalize(view.features->keypoints[match.a]));
    x_other.push_back(other.camera.Normalize(other.features->keypoints[match.b]));
  }
  const double scale = 0.5 * TwoViewOptions().error_px_max / std::min(focal_px, other_focal_px);
  return RefineTwoView(pair.other_from_photo, x, x_other, scale).rotation;
}

}  // namespace

Status AgreementOptions::Check() const {
  return OptionBounds()
      .Above("line_error_px_max", line_error_px_max, 0)
      .Above("point_error_px_max", point_error_px_max, 0)
      .Inside("rotation_deg_max", rotation_deg_max, 0, 180)
      .Above("rotation_px_max", rotation_px_max, 0)
      .AtLeast("rotation_narrow_factor", rotation_narrow_factor, 1.0)
      .Between("rotation_narrow_share", rotation_narrow_share, 0, 1)
      .AtLeast("rotation_matches_min", rotation_matches_min, 1)
      .status();
}

bool ExplainsPair(const CityMap& map, const MapImage& view, const MapImage& other,
                  const PairMatches& pair, const AgreementOptions& options) {
  const std::vector<FeatureMatch>& matches = pair.matches;
  const Rigid3 other_from_view = other.cam_from_world * view.cam_from_world.Inverse();
  const double focal_px = std::min(view.camera.focal_px(), other.camera.focal_px());
  const Eigen::Matrix3d essential = EssentialFromPose(other_from_view);
  const double distance_max = options.line_error_px_max / focal_px;
  const double point_error_px_max = options.point_error_px_max;
  size_t explained = 0;
  for (const FeatureMatch& match : matches) {
    const Eigen::Vector2d x = view.camera.Normalize(view.features->keypoints[match.a]),
                          x_other = other.camera.Normalize(other.features->keypoints[match.b]);
    explained += SampsonDistance(essential, x, x_other) < distance_max &&
                 FallsNear(map, view, match.a, other, match.b, point_error_px_max) &&
                 FallsNear(map, other, match.b, view, match.a, point_error_px_max);
  }
  return 2 * explained >= matches.size();
}

bool IsTurned(const MapImage& view, const MapImage& other, const PairMatches& pair,
              const AgreementOptions& options) {
  const Rigid3 other_from_view = other.cam_from_world * view.cam_from_world.Inverse();
  const double focal_px = std::min(view.camera.focal_px(), other.camera.focal_px());
  if (pair.geometry != PairGeometry::kGeneral || pair.matches.size() < options.rotation_matches_min)
    return false;
  const double angle_max =
      std::max(options.rotation_deg_max * kRadPerDeg, options.rotation_px_max / focal_px);
  const double angle = other_from_view.rotation.angularDistance(RotationOf(pair, view, other));
  return angle > angle_max && (angle > options.rotation_narrow_factor * angle_max ||
                               !IsNarrow(view, other, pair.matches, options.rotation_narrow_share));
}

NeighborAgreement CheckNeighbors(const CityMap& map, ReconstructionId reconstruction,
                                 const MapImage& view, std::span<const PairMatches> pairs,
                                 const AgreementOptions& options) {
  NeighborAgreement agreement;
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other) || map.image(pair.other).reconstruction != reconstruction)
      continue;
    if (pair.geometry == PairGeometry::kRotation) continue;
    const bool agrees = ExplainsPair(map, view, map.image(pair.other), pair, options);
    ++(agrees ? agreement.agreeing_images : agreement.contradicting_images);
    (agrees ? agreement.agreeing_matches : agreement.contradicting_matches) += pair.matches.size();
  }
  return agreement;
}

}  // namespace veduta
