// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/merge_candidates.h"

#include <algorithm>
#include <set>

#include "engine/mapping/similarity.h"

namespace veduta {
namespace {

// Points that a similarity is fitted to, at least: three determine it. Chosen by hand; not
// measured.
constexpr uint32_t kFittedPointsMin = 6;

void AppendCommon(const CityMap& map, ImageId image, const PairMatches& pair,
                  std::set<PointPair>* common) {
  for (const FeatureMatch& match : pair.matches) {
    const PointId into = map.image(image).points[match.a],
                  from = map.image(pair.other).points[match.b];
    if (into.valid() && from.valid() && map.FindPoint(into) && map.FindPoint(from))
      common->insert({into, from});
  }
}

// Whether `position` falls where the first and the last image of the point's track see it.
bool FallsOnViews(const CityMap& map, const PointRecord& point, const Eigen::Vector3d& position,
                  double error_px_max) {
  for (const TrackElement& element : {point.track.front(), point.track.back()}) {
    if (ReprojectionErrorPx(map.image(element.image).ViewOf(element.feature), position) >
        error_px_max)
      return false;
  }
  return true;
}

// Whether one position explains all views of both points, those of `from` carried over. Two small
// reconstructions know the depth of what is far away badly, and where their points lie says less
// than where they are seen.
bool IsOnePlace(const CityMap& map, const PointRecord& into, const PointRecord& from,
                const Sim3& into_from, double error_px_max) {
  std::vector<Sighting> views = map.ViewsOf(into);
  for (Sighting view : map.ViewsOf(from)) {
    view.cam_from_world = TransformCameraWorld(into_from, view.cam_from_world);
    views.push_back(view);
  }
  const auto position = Triangulate(views);
  return position && std::all_of(views.begin(), views.end(), [&](const Sighting& view) {
           return ReprojectionErrorPx(view, *position) <= error_px_max;
         });
}

}  // namespace

Result<std::map<ReconstructionId, std::vector<PointPair>>> FindCommonPoints(
    MapLoader* loader, const CityMap& map, std::span<const ImageId> near, ImageId photo,
    std::span<const PairMatches> pairs) {
  const ReconstructionId into = map.image(photo).reconstruction;
  std::map<ReconstructionId, std::set<PointPair>> common;
  const auto append = [&](ImageId image, const PairMatches& pair) {
    if (!map.HasImage(pair.other) || map.image(pair.other).reconstruction == into)
      return Status::Ok();
    // All images that see a point of either are loaded: in these it is judged whether points
    // coincide.
    const ImageId both[] = {image, pair.other};
    VEDUTA_RETURN_IF_ERROR(loader->LoadNeighborhood(both));
    AppendCommon(map, image, pair, &common[map.image(pair.other).reconstruction]);
    return Status::Ok();
  };
  for (const PairMatches& pair : pairs) VEDUTA_RETURN_IF_ERROR(append(photo, pair));
  for (const ImageId image : near) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                            loader->snapshot().ListNeighbors(image));
    for (const PairNeighbor& neighbor : neighbors) {
      const ImageId other[] = {neighbor.image};
      VEDUTA_RETURN_IF_ERROR(loader->LoadImages(other));
      if (!map.HasImage(neighbor.image) || map.image(neighbor.image).reconstruction == into)
        continue;
      VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored, loader->GetPair(image, neighbor.image));
      VEDUTA_RETURN_IF_ERROR(append(image, MatchesFrom(stored, image)));
    }
  }
  std::map<ReconstructionId, std::vector<PointPair>> found;
  for (const auto& [id, points] : common) found[id].assign(points.begin(), points.end());
  return found;
}

std::optional<PointAlignment> AlignPoints(const CityMap& map, std::span<const PointPair> pairs,
                                          double error_px_max, uint32_t count_min, uint64_t seed) {
  std::vector<Eigen::Vector3d> into, from;
  for (const PointPair& pair : pairs) {
    into.push_back(map.point(pair.into).position);
    from.push_back(map.point(pair.from).position);
  }
  const auto agrees = [&](const Sim3& into_from, size_t i) {
    return FallsOnViews(map, map.point(pairs[i].into), into_from * from[i], error_px_max) &&
           FallsOnViews(map, map.point(pairs[i].from), into_from.Inverse() * into[i], error_px_max);
  };
  const auto fit =
      EstimateSimilarity(from, into, agrees, std::max(kFittedPointsMin, count_min / 2), seed);
  if (!fit) return std::nullopt;
  PointAlignment alignment{fit->b_from_a, {}};
  std::set<PointId> distinct_into, distinct_from;
  for (const PointPair& pair : pairs) {
    if (!IsOnePlace(map, map.point(pair.into), map.point(pair.from), fit->b_from_a, error_px_max))
      continue;
    alignment.agreeing.push_back(pair);
    distinct_into.insert(pair.into);
    distinct_from.insert(pair.from);
  }
  if (std::min(distinct_into.size(), distinct_from.size()) < count_min) return std::nullopt;
  return alignment;
}

}  // namespace veduta
