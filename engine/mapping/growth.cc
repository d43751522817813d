// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/growth.h"

#include <algorithm>
#include <optional>
#include <set>

#include "engine/matching/guided_matcher.h"
#include "engine/matching/two_view.h"

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Everything that the matches say about one feature of the new image.
struct FeatureEvidence {
  std::vector<PointId> points;  // ascending, distinct
  std::vector<TrackElement>
      unplaced;  // matched features that have no point yet, in the order of the pairs
};

std::vector<FeatureEvidence> GatherEvidence(const CityMap& map, const MapImage& image,
                                            std::span<const PairMatches> pairs) {
  std::vector<FeatureEvidence> evidence(image.features->size());
  for (const PairMatches& pair : pairs) {
    if (!map.HasImage(pair.other) || map.image(pair.other).reconstruction != image.reconstruction)
      continue;
    const MapImage& other = map.image(pair.other);
    for (const FeatureMatch& match : pair.matches) {
      const PointId point = other.points[match.b];
      if (!point.valid()) {
        evidence[match.a].unplaced.push_back({pair.other, match.b});
      } else if (map.FindPoint(point) != nullptr) {
        evidence[match.a].points.push_back(point);
      }
    }
  }
  for (FeatureEvidence& e : evidence) {
    std::sort(e.points.begin(), e.points.end());
    e.points.erase(std::unique(e.points.begin(), e.points.end()), e.points.end());
  }
  return evidence;
}

bool AllWithin(std::span<const Sighting> views, const Eigen::Vector3d& point, double error_px_max) {
  return std::all_of(views.begin(), views.end(), [&](const Sighting& view) {
    return ReprojectionErrorPx(view, point) <= error_px_max;
  });
}

bool SeesImage(const PointRecord& point, ImageId image) {
  return std::any_of(point.track.begin(), point.track.end(),
                     [&](const TrackElement& e) { return e.image == image; });
}

// Joins the feature to the candidate that it fits best.
std::optional<PointId> JoinBest(CityMap* map, ImageId image, FeatureIndex feature,
                                const std::vector<PointId>& candidates, double error_px_max) {
  const Sighting view = map->image(image).ViewOf(feature);
  std::optional<PointId> best;
  double best_error = error_px_max;
  for (const PointId id : candidates) {
    const PointRecord* point = map->FindPoint(id);
    if (point == nullptr || SeesImage(*point, image)) continue;
    const double error = ReprojectionErrorPx(view, point->position);
    if (error < best_error) best_error = error, best = id;
  }
  if (best) map->AddObservation(*best, {image, feature});
  return best;
}

// Triangulates the feature with the match that gives the widest angle, and takes in the others that
// agree.
bool TryTriangulate(CityMap* map, ImageId image, FeatureIndex feature,
                    const std::vector<TrackElement>& matched, const GrowthOptions& options) {
  const Sighting view = map->image(image).ViewOf(feature);
  std::vector<TrackElement> best_track;
  Eigen::Vector3d best_position = Eigen::Vector3d::Zero();
  double best_angle = 0;
  for (const TrackElement& seed : matched) {
    const MapImage& other = map->image(seed.image);
    if (other.points[seed.feature].valid()) continue;
    std::vector<Sighting> views = {view, other.ViewOf(seed.feature)};
    auto position = Triangulate(views);
    if (!position || !AllWithin(views, *position, options.error_px_max)) continue;
    std::vector<TrackElement> track = {{image, feature}, seed};
    for (const TrackElement& element : matched) {
      const MapImage& third = map->image(element.image);
      const bool known = std::any_of(track.begin(), track.end(),
                                     [&](const auto& e) { return e.image == element.image; });
      if (known || third.points[element.feature].valid()) continue;
      const Sighting third_view = third.ViewOf(element.feature);
      if (ReprojectionErrorPx(third_view, *position) > 2 * options.error_px_max) continue;
      views.push_back(third_view);
      const auto moved = Triangulate(views);
      if (moved && AllWithin(views, *moved, options.error_px_max)) {
        position = moved;
        track.push_back(element);
      } else {
        views.pop_back();
      }
    }
    const double angle = TriangulationAngleDeg(views, *position);
    if (angle < options.angle_deg_min) continue;
    if (track.size() > best_track.size() ||
        (track.size() == best_track.size() && angle > best_angle)) {
      best_track = std::move(track), best_position = *position, best_angle = angle;
    }
  }
  if (best_track.size() < options.views_min) return false;
  map->AddPoint(image, best_position, std::move(best_track));
  return true;
}

}  // namespace

Status GrowthOptions::Check() const {
  return OptionBounds()
      .Above("error_px_max", error_px_max, 0)
      .Require("angle_deg_min", angle_deg_min, angle_deg_min >= 0 && angle_deg_min < 90,
               "0 or more and less than 90")
      .Above("search_radius_px", search_radius_px, 0)
      .AtLeast("descriptor_distance_squared_max", descriptor_distance_squared_max, 1)
      .AtLeast("scale_ratio_max", scale_ratio_max, 1)
      .AtLeast("views_min", views_min, 2)
      .AtLeast("guided_views_min", guided_views_min, 2)
      .AboveUpTo("guided_band_px", guided_band_px, 0, 64)
      .AboveUpTo("guided_ratio_max", guided_ratio_max, 0, 1)
      .status();
}

bool TryMergePoints(CityMap* map, PointId keep, PointId drop, double error_px_max) {
  const PointRecord *a = map->FindPoint(keep), *b = map->FindPoint(drop);
  if (a == nullptr || b == nullptr || keep == drop || map->SharesImage(*a, *b)) return false;
  std::vector<Sighting> views = map->ViewsOf(*a);
  const std::vector<Sighting> more = map->ViewsOf(*b);
  views.insert(views.end(), more.begin(), more.end());
  const auto position = Triangulate(views);
  if (!position || !AllWithin(views, *position, error_px_max)) return false;
  map->MergePoints(keep, drop);
  map->SetPosition(keep, *position);
  return true;
}

GrowthCounts GrowFromMatches(CityMap* map, ImageId image, std::span<const PairMatches> pairs,
                             const GrowthOptions& options) {
  GrowthCounts counts;
  const std::vector<FeatureEvidence> evidence = GatherEvidence(*map, map->image(image), pairs);
  for (FeatureIndex f = 0; f < evidence.size(); ++f) {
    const FeatureEvidence& e = evidence[f];
    if (!e.points.empty()) {
      std::optional<PointId> joined = map->image(image).points[f];
      if (!joined->valid()) {
        joined = JoinBest(map, image, f, e.points, options.error_px_max);
        counts.observations_added += joined.has_value();
      }
      if (!joined) continue;
      for (const PointId other : e.points)
        counts.points_merged += TryMergePoints(map, *joined, other, options.error_px_max);
      // Matched features that have no point yet belong to it as well when it lands on them.
      for (const TrackElement& element : e.unplaced) {
        const PointRecord& point = map->point(*joined);
        const MapImage& other = map->image(element.image);
        if (other.points[element.feature].valid() || SeesImage(point, element.image)) continue;
        if (ReprojectionErrorPx(other.ViewOf(element.feature), point.position) >
            options.error_px_max)
          continue;
        map->AddObservation(*joined, element);
        ++counts.observations_added;
      }
    } else if (!e.unplaced.empty() && !map->image(image).points[f].valid()) {
      counts.points_added += TryTriangulate(map, image, f, e.unplaced, options);
    }
  }
  return counts;
}

PairMatches MatchPlaced(const CityMap& map, ImageId image_id, ImageId other_id,
                        const GrowthOptions& options) {
  const MapImage &image = map.image(image_id), &other = map.image(other_id);
  const auto inverse_intrinsics = [](const Pinhole& c) {
    Eigen::Matrix3d k;
    k << 1 / c.fx, 0, -c.cx / c.fx, 0, 1 / c.fy, -c.cy / c.fy, 0, 0, 1;
    return k;
  };
  PairMatches pair;
  pair.other = other_id;
  pair.other_from_photo = other.cam_from_world * image.cam_from_world.Inverse();
  const double baseline = pair.other_from_photo.translation.norm();
  if (!(baseline > 0)) return pair;
  pair.other_from_photo.translation /= baseline;
  const Eigen::Matrix3d fundamental = inverse_intrinsics(other.camera).transpose() *
                                      EssentialFromPose(pair.other_from_photo) *
                                      inverse_intrinsics(image.camera);
  GuidedMatchOptions guided;
  guided.band_px = options.guided_band_px;
  guided.ratio_max = options.guided_ratio_max;
  guided.distance_squared_max = options.descriptor_distance_squared_max;
  const auto found =
      MatchGuided(*image.features, *other.features, *other.grid, fundamental, guided);
  if (!found.ok()) return pair;
  for (const DescriptorMatch& m : *found) pair.matches.push_back({m.a, m.b});
  return pair;
}

}  // namespace veduta
