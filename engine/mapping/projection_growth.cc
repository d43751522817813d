// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/projection_growth.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <unordered_set>
#include <utility>
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

struct Finding {
  PointId point;
  FeatureIndex feature;
};

// What an image was found to see, and around which images it was looked for.
struct Surroundings {
  std::vector<ImageId> near;      // ascending; the images whose points were looked for
  std::vector<Finding> findings;  // ascending points
};

// The images whose points are looked for.
struct Neighbors {
  std::span<const ImageId> among;
  size_t covisible_max;
};

std::vector<ImageId> FindNearImages(const CityMap& map, ImageId image, const Neighbors& of) {
  std::vector<ImageId> near = CovisibleImages(map, image, of.covisible_max, of.among);
  std::sort(near.begin(), near.end());
  return near;
}

Surroundings LookAround(const CityMap& map, ImageId image, const Neighbors& neighbors,
                        const GrowthOptions& options) {
  Look look(map, image, options);
  Surroundings around{FindNearImages(map, image, neighbors), {}};
  for (const PointId id : map.PointsSeenBy(around.near)) {
    if (const auto feature = look.Find(map.point(id))) around.findings.push_back({id, *feature});
  }
  return around;
}

// Adds to the map what images were found to see side by side, one image after another, and finds
// anew what the images before have made untrue.
class Addition {
 public:
  Addition(CityMap* map, const Neighbors& neighbors, const GrowthOptions& options)
      : map_(map), neighbors_(neighbors), options_(options) {}

  // Returns how many observations were added.
  uint32_t Add(ImageId image, Surroundings around) {
    Update(image, &around);
    uint32_t added = 0;
    for (const Finding& finding : around.findings) {
      if (map_->image(image).points[finding.feature].valid()) continue;
      map_->AddObservation(finding.point, {image, finding.feature});
      changed_.insert(finding.point);
      for (const TrackElement& element : map_->point(finding.point).track)
        touched_.insert(element.image);
      ++added;
    }
    return added;
  }

 private:
  // Makes the surroundings those that the image has by now.
  void Update(ImageId image, Surroundings* around) {
    // The rank of the images around changes where a point that the image sees got another view.
    std::vector<ImageId> near =
        touched_.contains(image) ? FindNearImages(*map_, image, neighbors_) : around->near;
    std::vector<Finding>& findings = around->findings;
    std::erase_if(findings, [&](const Finding& finding) {
      return changed_.contains(finding.point) || !SeesOneOf(finding.point, near);
    });
    std::vector<PointId> again = map_->PointsSeenBy(Without(near, around->near));
    std::ranges::copy_if(changed_, std::back_inserter(again),
                         [&](PointId id) { return SeesOneOf(id, near); });
    Look look(*map_, image, options_);
    for (const PointId id : again) {
      if (const auto feature = look.Find(map_->point(id))) findings.push_back({id, *feature});
    }
    std::ranges::sort(findings, {}, &Finding::point);
    const auto same_point = [](const Finding& a, const Finding& b) { return a.point == b.point; };
    findings.erase(std::unique(findings.begin(), findings.end(), same_point), findings.end());
    around->near = std::move(near);
  }

  // The elements of `all` that are not in `some`; both ascend.
  static std::vector<ImageId> Without(std::span<const ImageId> all, std::span<const ImageId> some) {
    std::vector<ImageId> rest;
    std::ranges::set_difference(all, some, std::back_inserter(rest));
    return rest;
  }

  bool SeesOneOf(PointId id, std::span<const ImageId> ascending) const {
    return std::ranges::any_of(map_->point(id).track, [&](const TrackElement& element) {
      return std::ranges::binary_search(ascending, element.image);
    });
  }

  CityMap* const map_;
  const Neighbors neighbors_;
  const GrowthOptions& options_;
  std::unordered_set<PointId> changed_;  // points whose track has grown
  std::unordered_set<ImageId> touched_;  // images that see one of them
};

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
                                 std::span<const ImageId> among, size_t covisible_max,
                                 const GrowthOptions& options, ThreadPool* pool) {
  GrowthCounts counts;
  const Neighbors neighbors{among, covisible_max};
  for (size_t begin = 0; begin < images.size(); begin += kImagesAtOnce) {
    const auto some = images.subspan(begin, std::min(kImagesAtOnce, images.size() - begin));
    std::vector<Surroundings> around(some.size());
    const auto look = [&](size_t i) { around[i] = LookAround(*map, some[i], neighbors, options); };
    if (pool != nullptr) {
      pool->ParallelFor(some.size(), look);
    } else {
      for (size_t i = 0; i < some.size(); ++i) look(i);
    }
    Addition addition(map, neighbors, options);
    for (size_t i = 0; i < some.size(); ++i)
      counts.observations_added += addition.Add(some[i], std::move(around[i]));
  }
  return counts;
}

}  // namespace veduta
