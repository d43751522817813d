// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/founding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "engine/mapping/pair_matches.h"
#include "engine/mapping/plane_twin.h"
#include "engine/mapping/pose_deviation.h"
#include "engine/mapping/structure_matches.h"
#include "storage/base/angle.h"
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
      const double sine = std::sin(std::max(angle_deg, 1e-3) * kRadPerDeg);
      sum += 1 / (sine * sine);
    }
    const double n = static_cast<double>(placed.inliers.size());
    if (sum / (n * n) < best.depth_variance)
      best = {image.id, placed.cam_from_world, sum / (n * n)};
  }
  return best;
}

bool PlacePair(const FoundingViews& views, const PairRecord& pair, const Rigid3& b_from_a,
               ReconstructionId reconstruction, const FoundingOptions& options, CityMap* map) {
  map->Clear();
  map->PlaceImage(Placed(Find(views, pair.a), reconstruction, Rigid3{}));
  map->PlaceImage(Placed(Find(views, pair.b), reconstruction, b_from_a));
  const PairMatches matches = MatchesFrom(pair, pair.b);
  GrowFromMatches(map, pair.b, {&matches, 1}, options.growth);
  const ImageId both[] = {pair.a, pair.b};
  return map->PointsSeenBy(both).size() >= options.common_points_min;
}

std::vector<ImageId> IdsOf(const CityMap& map) {
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  return ids;
}

// The points that all three views see and whose rays meet at a sufficient angle. Two views agree
// with a point wherever they stand; the third tells.
struct TripleFit {
  uint32_t common_points = 0;
  double mean_squared_px = 0;

  // Points over their mean squared error, which sums what they weigh.
  double Score() const { return common_points / std::max(mean_squared_px, 1e-6); }
};

TripleFit FitOf(const CityMap& map, double angle_deg_min) {
  const std::vector<ImageId> ids = IdsOf(map);
  TripleFit fit;
  double sum = 0;
  for (const PointId id : map.PointsSeenBy(ids)) {
    const PointRecord& point = map.point(id);
    if (point.track.size() != ids.size() ||
        !(TriangulationAngleDeg(map.ViewsOf(point), point.position) > angle_deg_min))
      continue;
    ++fit.common_points;
    for (const TrackElement& element : point.track) {
      const MapImage& image = map.image(element.image);
      const Eigen::Vector2d x = image.camera.Normalize(image.features->keypoints[element.feature]);
      sum += ((image.cam_from_world * point.position).hnormalized() - x).squaredNorm() *
             image.camera.focal_px() * image.camera.focal_px();
    }
  }
  const double observations = static_cast<double>(fit.common_points * ids.size());
  fit.mean_squared_px = observations > 0 ? sum / observations : 0;
  return fit;
}

// Whether what the views see says where each of them stands.
bool IsDetermined(const CityMap& map, const FoundingOptions& options) {
  return std::ranges::all_of(map.images(), [&](const auto& image) {
    return DeviationShare(map, image.first) <= options.deviation_share_max &&
           DeviationShareInNetwork(map, image.first, 2) <= options.network_deviation_share_max;
  });
}

// Adjusts and filters twice. False when the views do not fit together.
bool AdjustTriple(CityMap* map, const FoundingOptions& options) {
  const std::vector<ImageId> ids = IdsOf(*map);
  for (int round = 0; round < 2; ++round) {
    const std::vector<PointId> points = map->PointsSeenBy(ids);
    if (points.size() < options.common_points_min) return false;
    // Most of what three views see, two of them see: each point counts alike here, as it does where
    // these poses are asked how sure they are.
    BundleOptions alike = options.bundle;
    alike.two_view_weight = 1;
    const auto summary = AdjustBundle(map, ids, points, alike, nullptr);
    if (!summary.ok() || (round == 1 && summary->final_rms_px > options.rms_px_max)) return false;
    FilterPoints(map, points, options.filter);
  }
  return true;
}

// What a triple is founded from.
struct Triple {
  const FoundingViews& views;
  const PairRecord& first;
  ImageId required;
  ReconstructionId reconstruction;
  uint64_t seed;
};

// Founds with the first pair in that relative pose.
FoundingOutcome FoundFrom(const Triple& triple, const Rigid3& b_from_a,
                          const FoundingOptions& options, CityMap* map) {
  const FoundingViews& views = triple.views;
  if (!PlacePair(views, triple.first, b_from_a, triple.reconstruction, options, map))
    return FoundingOutcome::kNoPair;
  const ThirdView third = ChooseThird(views, *map, triple.first, triple.required,
                                      triple.reconstruction, triple.seed, options);
  if (!third.id.valid()) return FoundingOutcome::kNoThirdView;
  map->PlaceImage(Placed(Find(views, third.id), triple.reconstruction, third.cam_from_world));
  GrowFromMatches(map, third.id, PairsOf(views, third.id), options.growth);
  if (!AdjustTriple(map, options) ||
      FitOf(*map, options.angle_deg_min).common_points < options.common_points_min)
    return FoundingOutcome::kTooFewPoints;
  return IsDetermined(*map, options) ? FoundingOutcome::kFounded : FoundingOutcome::kUndetermined;
}

// The other relative pose of the first pair, if what they see were a plane.
std::optional<Rigid3> TwinOf(const PairRecord& first, const CityMap& map) {
  const Rigid3& a = map.image(first.a).cam_from_world;
  const ImageId both[] = {first.a, first.b};
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d ray = Eigen::Vector3d::Zero();
  for (const PointId id : map.PointsSeenBy(both)) {
    points.push_back(a * map.point(id).position);
    ray += points.back().normalized();
  }
  const std::optional<Eigen::Vector3d> plane = FitPlane(points);
  if (!plane) return std::nullopt;
  return PlaneTwin(map.image(first.b).cam_from_world * a.Inverse(), *plane, ray);
}

// The views of the map and the pairs between them.
FoundingViews Only(const FoundingViews& views, const CityMap& map) {
  FoundingViews only = views;
  std::erase_if(only.images, [&](const MapImage& image) { return !map.HasImage(image.id); });
  std::erase_if(only.pairs, [&](const PairRecord& pair) {
    return !map.HasImage(pair.a) || !map.HasImage(pair.b);
  });
  return only;
}

// Compares what was founded with what the same three views are if they see a plane and the first
// two stand the other way, and takes the other where it is clearly better.
FoundingOutcome CompareWithTwin(const Triple& triple, const FoundingOptions& options,
                                CityMap* map) {
  const std::optional<Rigid3> twin = TwinOf(triple.first, *map);
  if (!twin) return FoundingOutcome::kFounded;
  const FoundingViews views = Only(triple.views, *map);
  CityMap other;
  const FoundingOutcome outcome =
      FoundFrom({views, triple.first, triple.required, triple.reconstruction, triple.seed}, *twin,
                options, &other);
  if (outcome == FoundingOutcome::kNoPair || outcome == FoundingOutcome::kNoThirdView)
    return FoundingOutcome::kFounded;
  const double score = FitOf(*map, options.angle_deg_min).Score(),
               other_score = FitOf(other, options.angle_deg_min).Score();
  if (other_score <= options.twin_score_share_max * score) return FoundingOutcome::kFounded;
  if (outcome != FoundingOutcome::kFounded || score > options.twin_score_share_max * other_score)
    return FoundingOutcome::kUndetermined;
  *map = std::move(other);
  return FoundingOutcome::kFounded;
}

}  // namespace

Status FoundingOptions::Check() const {
  return OptionBounds()
      .AtLeast("common_points_min", common_points_min, 3)
      .Inside("angle_deg_min", angle_deg_min, 0, 90)
      .AtLeast("pairs_tried_max", pairs_tried_max, 1)
      .Between("explained_share_min", explained_share_min, 0, 1)
      .Above("deviation_share_max", deviation_share_max, 0)
      .Above("network_deviation_share_max", network_deviation_share_max, 0)
      .Above("twin_score_share_max", twin_score_share_max, 0)
      .Between("repeated_share_max", repeated_share_max, 0, 1)
      .Above("rms_px_max", rms_px_max, 0)
      .Part("repetition", repetition.Check())
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
                            const FoundingOptions& options, CityMap* map,
                            RepetitionMemory* memory) {
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
    const Triple triple{views, *pair, required, reconstruction, seed};
    FoundingOutcome of_pair = FoundFrom(triple, pair->b_from_a, options, map);
    if (of_pair == FoundingOutcome::kFounded) of_pair = CompareWithTwin(triple, options, map);
    if (of_pair == FoundingOutcome::kFounded) {
      if (RepeatedShare(views.images, views.pairs, options.repetition, memory) <=
          options.repeated_share_max)
        return of_pair;
      outcome = FoundingOutcome::kRepeated;
      break;
    }
    outcome = std::max(outcome, of_pair);
  }
  map->Clear();
  return outcome;
}

}  // namespace veduta
