// SPDX-License-Identifier: Apache-2.0
#include "engine/query/ground_sightings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "engine/camera/orientation.h"
#include "engine/camera/projection.h"
#include "engine/mapping/triangulation.h"

namespace veduta {
namespace {

// Below it a depth is a guess. Chosen by hand.
constexpr double kAngleDegMin = 1;

std::optional<SeenGroundPoint> See(std::span<const Sighting> views) {
  if (views.size() < 2) return std::nullopt;
  const std::optional<Eigen::Vector3d> world = Triangulate(views);
  if (!world) return std::nullopt;
  const double angle_deg = TriangulationAngleDeg(views, *world);
  if (angle_deg < kAngleDegMin) return std::nullopt;
  SeenGroundPoint seen;
  seen.world = *world;
  double pixel = 0, squares = 0;  // pixel: what 1 px is at the point's distance
  for (const Sighting& view : views) {
    pixel += (view.cam_from_world * *world).norm() / view.camera.fx;
    const double error = ReprojectionErrorPx(view, *world);
    squares += error * error;
  }
  const auto count = static_cast<double>(views.size());
  // Rays that meet at an angle fix the point along them only as well as that is large.
  const double sine = std::sin(std::min(angle_deg, 90.0) * std::numbers::pi / 180);
  seen.error_px = std::sqrt(squares / count);
  // Where the photos do not agree upon the point, their poses are off, all together.
  seen.deviation =
      pixel / count / sine * (seen.error_px > 1 ? seen.error_px : std::sqrt(2 / count));
  return seen;
}

}  // namespace

Result<std::vector<SeenGroundPoint>> SeeGroundPoints(const Snapshot& snapshot,
                                                     std::span<const GroundPoint> points) {
  std::vector<SeenGroundPoint> all;
  for (size_t i = 0; i < points.size(); ++i) {
    std::map<ReconstructionId, std::vector<Sighting>> views;
    for (const GroundSighting& sighting : points[i].sightings) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose,
                              snapshot.FindPose(sighting.image));
      if (!pose) continue;
      VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(sighting.image));
      VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot.GetCamera(image.camera));
      const Eigen::Vector2d place = StoredFromUpright(
          {sighting.x_px, sighting.y_px}, {image.width_px, image.height_px}, image.orientation);
      const auto undistorted = UndistortPixel(camera.model, place);
      if (!undistorted) continue;
      views[pose->reconstruction].push_back(
          {pose->cam_from_world, Pinhole(camera.model), *undistorted});
    }
    for (const auto& [reconstruction, of_one] : views) {
      std::optional<SeenGroundPoint> seen = See(of_one);
      if (!seen) continue;
      seen->point = i;
      seen->reconstruction = reconstruction;
      all.push_back(*seen);
    }
  }
  return all;
}

}  // namespace veduta
