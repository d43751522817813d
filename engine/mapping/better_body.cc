// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/better_body.h"

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "engine/mapping/body_place.h"
#include "engine/mapping/single_linkage.h"
#include "engine/mapping/triangulation.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

bool Holds(std::span<const ImageId> ascending, ImageId id) {
  return std::ranges::binary_search(ascending, id);
}

// Points as one side alone sees them.
class Side {
 public:
  // The side of the body, or that of the rest.
  Side(const CityMap& map, std::span<const ImageId> body, bool is_body)
      : map_(map), body_(body), is_body_(is_body) {}

  // Nothing where fewer than two of the side's images see the point.
  const std::optional<Eigen::Vector3d>& Position(PointId id) {
    const auto [place, is_new] = positions_.try_emplace(id);
    if (!is_new) return place->second;
    PointRecord point = map_.point(id);
    std::erase_if(point.track,
                  [&](const TrackElement& e) { return Holds(body_, e.image) != is_body_; });
    if (point.track.size() >= 2) place->second = Triangulate(map_.ViewsOf(point));
    return place->second;
  }

 private:
  const CityMap& map_;
  const std::span<const ImageId> body_;
  const bool is_body_;
  std::map<PointId, std::optional<Eigen::Vector3d>> positions_;
};

// What cameras of one side see of the other side's points, each view of a point once.
class Sightings {
 public:
  Sightings(const CityMap& map, Side* points) : map_(map), points_(*points) {}

  void Add(const MapImage& view, FeatureIndex feature, PointId id) {
    if (!id.valid() || map_.FindPoint(id) == nullptr || !seen_.insert({view.id, id}).second) return;
    const std::optional<Eigen::Vector3d>& position = points_.Position(id);
    if (!position) return;
    list.push_back({view.id, view.cam_from_world,
                    view.camera.Normalize(view.features->keypoints[feature]), *position,
                    view.camera.focal_px()});
  }

  std::vector<CrossSighting> list;

 private:
  const CityMap& map_;
  Side& points_;
  std::set<std::pair<ImageId, PointId>> seen_;
};

// Those that see most points together first, then ascending. Nodes are places in `images`.
std::vector<Link> ListLinks(const CityMap& map, std::span<const ImageId> images) {
  std::vector<std::pair<ImageId, ImageId>> shared;  // once for each point
  for (const PointId id : map.PointsSeenBy(images)) {
    const std::vector<TrackElement>& track = map.point(id).track;
    for (size_t i = 0; i < track.size(); ++i) {
      if (!Holds(images, track[i].image)) continue;
      for (size_t j = i + 1; j < track.size(); ++j) {
        if (Holds(images, track[j].image)) shared.emplace_back(track[i].image, track[j].image);
      }
    }
  }
  std::ranges::sort(shared);
  std::vector<std::pair<uint32_t, Link>> counted;  // points
  const auto place = [&](ImageId id) {
    return static_cast<uint32_t>(std::ranges::lower_bound(images, id) - images.begin());
  };
  for (size_t i = 0; i < shared.size(); ++i) {
    if (i == 0 || shared[i] != shared[i - 1])
      counted.push_back({0, {place(shared[i].first), place(shared[i].second)}});
    ++counted.back().first;
  }
  std::ranges::stable_sort(counted, std::greater<>(), &std::pair<uint32_t, Link>::first);
  std::vector<Link> links;
  for (const auto& [points, link] : counted) links.push_back(link);
  return links;
}

}  // namespace

std::vector<std::vector<ImageId>> ListBodies(const CityMap& map, std::span<const ImageId> images,
                                             size_t images_max) {
  std::vector<std::vector<ImageId>> bodies;
  const std::vector<Link> links = ListLinks(map, images);
  for (const std::vector<uint32_t>& group :
       ListLinkedGroups(static_cast<uint32_t>(images.size()), links)) {
    if (group.size() < 2 || group.size() > images_max) continue;
    std::vector<ImageId>& body = bodies.emplace_back();
    for (const uint32_t place : group) body.push_back(images[place]);
  }
  return bodies;
}

std::optional<Sim3> FindBetterPlace(const CityMap& map, std::span<const ImageId> body,
                                    std::span<const BodyPair> pairs) {
  Side own(map, body, true), rest(map, body, false);
  Sightings in_body(map, &rest), in_rest(map, &own);
  for (const BodyPair& pair : pairs) {
    const MapImage &a = map.image(pair.image), &b = map.image(pair.matches.other);
    for (const FeatureMatch& match : pair.matches.matches) {
      in_body.Add(a, match.a, b.points[match.b]);
      in_rest.Add(b, match.b, a.points[match.a]);
    }
  }
  const std::optional<BodyPlace> found =
      FindBodyPlace(in_rest.list, in_body.list, MixSeed(body.front().value, body.size()));
  return found ? std::optional(found->new_from_old) : std::nullopt;
}

}  // namespace veduta
