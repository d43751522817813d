// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/projection_growth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "engine/mapping/covisible_images.h"
#include "engine/matching/guided_matcher.h"

namespace veduta {
namespace {

// Largest angle between the direction that a point is looked at from and the nearest direction that
// it was seen from: descriptors of one place seen from further apart differ. Chosen by hand; not
// measured.
constexpr double kViewAngleDegMax = 45;

// Images that are looked at side by side before what was found is added: the more, the more of it
// is out of date by then; the fewer, the sooner threads wait for each other. Chosen by hand; not
// measured.
constexpr size_t kImagesAtOnce = 32;

bool SeesImage(const PointRecord& point, ImageId image) {
  return std::any_of(point.track.begin(), point.track.end(),
                     [&](const TrackElement& e) { return e.image == image; });
}

// The element of the track seen from the direction nearest to `center`: what the point should look
// like from there. Null where even that direction is too far away.
const TrackElement* FindMostAlike(const CityMap& map, const PointRecord& point,
                                  const Eigen::Vector3d& center) {
  NearestDirection nearest(center, point.position);
  const TrackElement* best = nullptr;
  for (const TrackElement& element : point.track) {
    if (nearest.IsNearer(map.image(element.image).cam_from_world.Center())) best = &element;
  }
  return nearest.angle_deg() > kViewAngleDegMax ? nullptr : best;
}

// Looks in one placed image for the features that points should be seen by. Reads the map only.
class Look {
 public:
  Look(const CityMap& map, ImageId image, const GrowthOptions& options)
      : map_(map),
        image_(map.image(image)),
        center_(image_.cam_from_world.Center()),
        options_(options) {}

  // The feature that shows the point, if the image does not see it yet, whether or not the feature
  // has a point.
  std::optional<FeatureIndex> Find(const PointRecord& point) {
    if (SeesImage(point, image_.id)) return std::nullopt;
    const Eigen::Vector3d x_cam = image_.cam_from_world * point.position;
    if (!(x_cam.z() > 0)) return std::nullopt;
    const Eigen::Vector2d x_px = image_.camera.Project(x_cam);
    if (x_px.x() < 0 || x_px.y() < 0 || x_px.x() >= image_.width_px || x_px.y() >= image_.height_px)
      return std::nullopt;
    const TrackElement* const alike = FindMostAlike(map_, point, center_);
    if (alike == nullptr) return std::nullopt;
    const MapImage& known = map_.image(alike->image);
    const Keypoint& keypoint = known.features->keypoints[alike->feature];
    const auto found = FindNear(
        *image_.grid, *image_.features,
        {x_px.x(), x_px.y(), options_.search_radius_px, known.features->descriptor(alike->feature),
         keypoint.contrast_sign, options_.descriptor_distance_squared_max},
        &scratch_);
    if (!found) return std::nullopt;
    const double depth_known = (known.cam_from_world * point.position).z();
    const double scale_predicted = keypoint.scale_px * depth_known / x_cam.z() *
                                   image_.camera.focal_px() / known.camera.focal_px();
    const double ratio = image_.features->keypoints[found->feature].scale_px / scale_predicted;
    if (ratio > options_.scale_ratio_max || ratio < 1 / options_.scale_ratio_max)
      return std::nullopt;
    return found->feature;
  }

 private:
  const CityMap& map_;
  const MapImage& image_;
  const Eigen::Vector3d center_;
  const GrowthOptions& options_;
  GuidedScratch scratch_;
};

constexpr FeatureIndex kNoFeature = std::numeric_limits<FeatureIndex>::max();

// What was found for one point while its track had so many elements. Tracks only grow here, so one
// of that length is the same still.
struct Finding {
  PointId point;
  uint32_t track_size;
  FeatureIndex feature;  // kNoFeature where none was
};

std::vector<Finding> FindAround(const CityMap& map, ImageId image, size_t covisible_max,
                                const GrowthOptions& options) {
  Look look(map, image, options);
  std::vector<Finding> findings;
  for (const PointId id : map.PointsSeenBy(CovisibleImages(map, image, covisible_max))) {
    const PointRecord& point = map.point(id);
    findings.push_back(
        {id, static_cast<uint32_t>(point.track.size()), look.Find(point).value_or(kNoFeature)});
  }
  return findings;
}

// Adds what was found to the map, and finds anew what is out of date. `findings` ascend.
uint32_t AddFindings(CityMap* map, ImageId image, size_t covisible_max,
                     const GrowthOptions& options, const std::vector<Finding>& findings) {
  Look look(*map, image, options);
  uint32_t added = 0;
  auto known = findings.begin();
  for (const PointId id : map->PointsSeenBy(CovisibleImages(*map, image, covisible_max))) {
    const PointRecord& point = map->point(id);
    while (known != findings.end() && known->point < id) ++known;
    const bool is_known =
        known != findings.end() && known->point == id && known->track_size == point.track.size();
    const FeatureIndex feature = is_known ? known->feature : look.Find(point).value_or(kNoFeature);
    if (feature == kNoFeature || map->image(image).points[feature].valid()) continue;
    map->AddObservation(id, {image, feature});
    ++added;
  }
  return added;
}

}  // namespace

GrowthCounts GrowByProjection(CityMap* map, ImageId image, std::span<const PointId> points,
                              const GrowthOptions& options) {
  GrowthCounts counts;
  Look look(*map, image, options);
  for (const PointId id : points) {
    const PointRecord* const point = map->FindPoint(id);
    if (point == nullptr) continue;
    const std::optional<FeatureIndex> feature = look.Find(*point);
    if (!feature || map->image(image).points[*feature].valid()) continue;
    map->AddObservation(id, {image, *feature});
    ++counts.observations_added;
  }
  return counts;
}

GrowthCounts GrowAllByProjection(CityMap* map, std::span<const ImageId> images,
                                 size_t covisible_max, const GrowthOptions& options,
                                 ThreadPool* pool) {
  GrowthCounts counts;
  for (size_t begin = 0; begin < images.size(); begin += kImagesAtOnce) {
    const auto some = images.subspan(begin, std::min(kImagesAtOnce, images.size() - begin));
    std::vector<std::vector<Finding>> findings(some.size());
    const auto find = [&](size_t i) {
      findings[i] = FindAround(*map, some[i], covisible_max, options);
    };
    if (pool != nullptr) {
      pool->ParallelFor(some.size(), find);
    } else {
      for (size_t i = 0; i < some.size(); ++i) find(i);
    }
    for (size_t i = 0; i < some.size(); ++i) {
      counts.observations_added += AddFindings(map, some[i], covisible_max, options, findings[i]);
      findings[i] = {};
    }
  }
  return counts;
}

}  // namespace veduta
