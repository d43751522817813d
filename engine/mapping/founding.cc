// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/founding.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/mapping/pair_matches.h"
#include "engine/mapping/pose_deviation.h"
#include "engine/mapping/structure_matches.h"
#include "storage/base/content_hash.h"
#include "storage/base/option_bounds.h"
#include "storage/base/transform.h"
#include "storage/model/pair.h"

namespace veduta {
namespace {

const MapImage& Find(const FoundingViews& views, ImageId id) {
  const auto it =
      std::lower_bound(views.images.begin(), views.images.end(), id,
                       [](const MapImage& image, ImageId wanted) { return image.id < wanted; });
  VEDUTA_CHECK(it != views.images.end() && it->id == id,
               "view " + std::to_string(id.value) + " is not a candidate");
  return *it;
}

MapImage Placed(const MapImage& image, ReconstructionId reconstruction,
                const Rigid3& cam_from_world) {
  MapImage placed = image;
  placed.reconstruction = reconstruction;
  placed.cam_from_world = cam_from_world;
  placed.points.assign(image.features->size(), PointId{});
  return placed;
}

std::vector<PairMatches> PairsOf(const FoundingViews& views, ImageId image) {
  std::vector<PairMatches> pairs;
  for (const PairRecord& pair : views.pairs) {
    if (pair.a == image || pair.b == image) pairs.push_back(MatchesFrom(pair, image));
  }
  return pairs;
}

struct ThirdView {
  ImageId id;
  Rigid3 cam_from_world;
  double depth_variance = std::numeric_limits<double>::infinity();
};

// The third view of least depth variance, for a map that holds the first two.
ThirdView ChooseThird(const FoundingViews& views, const CityMap& map, const PairRecord& first,
                      ImageId required, ReconstructionId reconstruction, uint64_t seed,
                      const FoundingOptions& options) {
  ThirdView best;
  const bool first_has_required = first.a == required || first.b == required;
  const Eigen::Vector3d center_a = map.image(first.a).cam_from_world.Center();
  const Eigen::Vector3d center_b = map.image(first.b).cam_from_world.Center();
  for (const MapImage& image : views.images) {
    if (image.id == first.a || image.id == first.b || (!first_has_required && image.id != required))
      continue;
    const std::vector<PairMatches> pairs = PairsOf(views, image.id);
    const StructureMatches structure =
        GatherStructure(map, reconstruction, *image.features, image.camera, pairs);
    const Resection placed = Resect(structure.x, structure.positions, image.camera.focal_px(),
                                    MixSeed(seed, image.id.value), options.resection);
    if (placed.outcome != ResectionOutcome::kPlaced ||
        static_cast<double>(placed.inliers.size()) <
            options.explained_share_min * static_cast<double>(structure.x.size())) {
      continue;
    }
    const uint32_t rival =
        CountRivalInliers(structure.x, structure.positions, image.camera.focal_px(), placed,
                          MixSeed(seed, image.id.value), options.resection);
    if (options.resection.IsAmbiguous(placed.inliers.size(), rival)) continue;
    const Eigen::Vector3d center = placed.cam_from_world.Center();
    double sum = 0;
    for (const uint32_t i : placed.inliers) {
      const double angle_deg = std::max(RayAngleDeg(center, center_a, structure.positions[i]),
                                        RayAngleDeg(center, center_b, structure.positions[i]));
      const double sine = std::sin(std::max(angle_deg, 1e-3) * 0.017453292519943295);
      sum += 1 / (sine * sine);
    }
    const double n = static_cast<double>(placed.inliers.size());
    if (sum / (n * n) < best.depth_variance)
      best = {image.id, placed.cam_from_world, sum / (n * n)};
  }
  return best;
}

bool PlacePair(const FoundingViews& views, const PairRecord& pair, ReconstructionId reconstruction,
               const FoundingOptions& options, CityMap* map) {
  map->Clear();
  map->PlaceImage(Placed(Find(views, pair.a), reconstruction, Rigid3{}));
  map->PlaceImage(Placed(Find(views, pair.b), reconstruction, pair.b_from_a));
  const PairMatches matches = MatchesFrom(pair, pair.b);
  GrowFromMatches(map, pair.b, {&matches, 1}, options.growth);
  const ImageId both[] = {pair.a, pair.b};
  return map->PointsSeenBy(both).size() >= options.common_points_min;
}

uint32_t CountCommonPoints(const CityMap& map, double angle_deg_min) {
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  uint32_t count = 0;
  for (const PointId id : map.PointsSeenBy(ids)) {
    const PointRecord& point = map.point(id);
    count += point.track.size() == ids.size() &&
             TriangulationAngleDeg(map.ViewsOf(point), point.position) > angle_deg_min;
  }
  return count;
}

// Whether what the views see says where each of them stands.
bool IsDetermined(const CityMap& map, double deviation_share_max) {
  return std::ranges::all_of(map.images(), [&](const auto& image) {
    return DeviationShare(map, image.first) <= deviation_share_max;
  });
}

// Adjusts and filters twice. False when the views do not fit together.
bool AdjustTriple(CityMap* map, const FoundingOptions& options) {
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map->images()) ids.push_back(id);
  for (int round = 0; round < 2; ++round) {
    const std::vector<PointId> points = map->PointsSeenBy(ids);
    if (points.size() < options.common_points_min) return false;
    const auto summary = AdjustBundle(map, ids, points, options.bundle, nullptr);
    if (!summary.ok() || (round == 1 && summary->final_rms_px > options.rms_px_max)) return false;
    FilterPoints(map, points, options.filter);
  }
  return true;
}

}  // namespace

Status FoundingOptions::Check() const {
  return OptionBounds()
      .AtLeast("common_points_min", common_points_min, 3)
      .Inside("angle_deg_min", angle_deg_min, 0, 90)
      .AtLeast("pairs_tried_max", pairs_tried_max, 1)
      .Between("explained_share_min", explained_share_min, 0, 1)
      .Above("deviation_share_max", deviation_share_max, 0)
      .Above("rms_px_max", rms_px_max, 0)
      .Part("resection", resection.Check())
      .Part("growth", growth.Check())
      .Part("bundle", bundle.Check())
      .Part("filter", filter.Check())
      .status();
}

double DepthVariance(const PairRecord& pair, const MapImage& a, const MapImage& b) {
  if (pair.geometry == PairGeometry::kRotation || pair.matches.empty())
    return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const FeatureMatch& match : pair.matches) {
    const Eigen::Vector3d ray_a =
        pair.b_from_a.rotation *
        a.camera.Normalize(a.features->keypoints[match.a]).homogeneous().normalized();
    const Eigen::Vector3d ray_b =
        b.camera.Normalize(b.features->keypoints[match.b]).homogeneous().normalized();
    sum += 1 / std::max(ray_a.cross(ray_b).squaredNorm(), 1e-10);
  }
  const double n = static_cast<double>(pair.matches.size());
  return sum / (n * n);
}

FoundingOutcome TryFounding(const FoundingViews& views, ImageId required,
                            ReconstructionId reconstruction, uint64_t seed,
                            const FoundingOptions& options, CityMap* map) {
  std::vector<std::pair<double, const PairRecord*>> ranked;
  for (const PairRecord& pair : views.pairs) {
    const double variance = DepthVariance(pair, Find(views, pair.a), Find(views, pair.b));
    if (std::isfinite(variance)) ranked.emplace_back(variance, &pair);
  }
  // A plane has two essential matrices that explain it: pairs with depth come first.
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& x, const auto& y) {
    const bool x_plane = x.second->geometry == PairGeometry::kPlanar,
               y_plane = y.second->geometry == PairGeometry::kPlanar;
    return x_plane != y_plane ? y_plane : x.first < y.first;
  });
  if (ranked.size() > options.pairs_tried_max) ranked.resize(options.pairs_tried_max);

  FoundingOutcome outcome = FoundingOutcome::kNoPair;
  for (const auto& [variance, pair] : ranked) {
    if (!PlacePair(views, *pair, reconstruction, options, map)) continue;
    const ThirdView third =
        ChooseThird(views, *map, *pair, required, reconstruction, seed, options);
    outcome = std::max(outcome, FoundingOutcome::kNoThirdView);
    if (!third.id.valid()) continue;
    outcome = std::max(outcome, FoundingOutcome::kTooFewPoints);
    map->PlaceImage(Placed(Find(views, third.id), reconstruction, third.cam_from_world));
    GrowFromMatches(map, third.id, PairsOf(views, third.id), options.growth);
    if (!AdjustTriple(map, options) ||
        CountCommonPoints(*map, options.angle_deg_min) < options.common_points_min)
      continue;
    if (IsDetermined(*map, options.deviation_share_max)) return FoundingOutcome::kFounded;
    outcome = FoundingOutcome::kUndetermined;
  }
  map->Clear();
  return outcome;
}

}  // namespace veduta
