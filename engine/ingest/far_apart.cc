// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/far_apart.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "engine/earth/earth_pose.h"
#include "engine/earth/local_frame.h"

namespace veduta {
namespace {

// Standard deviations, and metres besides: receivers between houses are off by more than they say.
// Chosen by hand; not measured.
constexpr double kFarDeviations = 4, kFarM = 20;
constexpr double kElsewhereM = 10'000;

// One that is only now founded has no place yet.
Result<std::optional<EarthPlace>> PlaceOf(const Snapshot& snapshot, ReconstructionId id) {
  const Result<ReconstructionRecord> record = snapshot.GetReconstruction(id);
  if (record.status().code() == StatusCode::kNotFound) return std::optional<EarthPlace>();
  VEDUTA_RETURN_IF_ERROR(record.status());
  return record->georeference.place;
}

double LargestDeviation(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(
      Eigen::Matrix2d(covariance.topLeftCorner<2, 2>()));
  return std::sqrt(std::max(0.0, axes.eigenvalues()[1]));
}

}  // namespace

Result<std::optional<double>> FindFarApart(const Snapshot& snapshot, const CityMap& map,
                                           const SeamArea& seam, ReconstructionId into,
                                           ReconstructionId other, const Sim3& into_from_other) {
  if (seam.other.empty()) return std::optional<double>();
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<EarthPlace> own_place, PlaceOf(snapshot, into));
  if (!own_place) return std::optional<double>();
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<EarthPlace> other_place, PlaceOf(snapshot, other));
  if (!other_place) return std::optional<double>();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const ImageId id : seam.other) middle += map.image(id).cam_from_world.Center();
  middle /= static_cast<double>(seam.other.size());
  const Eigen::Vector3d carried = into_from_other * middle;
  const LocalFrame own_frame(own_place->origin), other_frame(other_place->origin);
  const Eigen::Vector3d there =
      own_frame.FromGeo(other_frame.ToGeo(other_place->enu_from_world * middle));
  const Eigen::Vector3d apart = own_place->enu_from_world * carried - there;
  // Round the earth the plan of the one tells nothing of the other.
  const bool is_elsewhere = std::abs(apart.z()) > kElsewhereM;
  const double apart_m = is_elsewhere ? apart.norm() : apart.head<2>().norm();
  const double deviation_m = std::hypot(LargestDeviation(PositionCovariance(*own_place, carried)),
                                        LargestDeviation(PositionCovariance(*other_place, middle)));
  const bool is_far = apart_m > kFarDeviations * deviation_m + kFarM;
  return is_far ? std::optional(apart_m) : std::nullopt;
}

}  // namespace veduta
