// SPDX-License-Identifier: Apache-2.0
#include "engine/query/earth_answers.h"

#include <algorithm>
#include <limits>
#include <map>

#include "engine/earth/earth_pose.h"
#include "engine/earth/local_frame.h"
#include "engine/query/ground_sightings.h"
#include "engine/query/living.h"

namespace veduta {

Result<std::optional<EarthPose>> EarthPoseIn(const Snapshot& snapshot,
                                             ReconstructionId reconstruction,
                                             const Rigid3& cam_from_world) {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          snapshot.GetReconstruction(reconstruction));
  const Georeference& georeference = record.georeference;
  if (!georeference.place) return std::optional<EarthPose>();
  return std::optional(EarthPoseOf(*georeference.place, georeference.version, cam_from_world));
}

Result<std::optional<EarthPose>> EarthPoseIn(const Snapshot& snapshot,
                                             ReconstructionId reconstruction,
                                             const PlainPose& cam_from_world,
                                             const std::optional<PoseUncertainty>& uncertainty) {
  const auto& [w, x, y, z] = cam_from_world.rotation_wxyz;
  const auto& [tx, ty, tz] = cam_from_world.translation;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          snapshot.GetReconstruction(reconstruction));
  const Georeference& georeference = record.georeference;
  if (!georeference.place) return std::optional<EarthPose>();
  EarthPose pose = EarthPoseOf(*georeference.place, georeference.version,
                               Rigid3{Eigen::Quaterniond(w, x, y, z), Eigen::Vector3d(tx, ty, tz)});
  if (uncertainty) AddUncertainty(*georeference.place, *uncertainty, &pose);
  return std::optional(pose);
}

Result<GeoreferenceAnswer> GeoreferenceOf(const Snapshot& snapshot) {
  GeoreferenceAnswer answer;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> living, ListLiving(snapshot));
  std::map<ReconstructionId, EarthPlace> places;
  for (const ReconstructionRecord& record : living) {
    EarthAnswer& earth = answer.reconstructions.emplace_back(EarthAnswerOf(record.georeference));
    earth.reconstruction = record.id;
    earth.images = record.image_count;
    if (record.georeference.place) places[record.id] = *record.georeference.place;
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<GroundPoint> points, snapshot.ListGroundPoints());
  for (const GroundPoint& point : points) answer.ground_points.emplace_back().point = point;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<SeenGroundPoint> seen,
                          SeeGroundPoints(snapshot, points));
  for (const SeenGroundPoint& one : seen) {
    const auto place = places.find(one.reconstruction);
    GroundPointAnswer& told = answer.ground_points[one.point];
    // Of several reconstructions that show it, the first one that has a place counts, or else the
    // first one.
    if (told.reconstruction.valid() || (place == places.end() && told.error_px > 0)) continue;
    told.error_px = std::max(one.error_px, std::numeric_limits<double>::min());
    if (place == places.end()) continue;
    told.reconstruction = one.reconstruction;
    const Eigen::Vector3d error = place->second.enu_from_world * one.world -
                                  LocalFrame(place->second.origin).FromGeo(told.point.position);
    told.error_m = {error.x(), error.y(), error.z()};
  }
  return answer;
}

}  // namespace veduta
