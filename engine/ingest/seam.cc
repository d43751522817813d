// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/seam.h"

#include <algorithm>
#include <map>
#include <set>

#include "engine/ingest/doubt.h"
#include "engine/mapping/resection.h"

namespace veduta {
namespace {

// Points that a carried view is moved by, at least: a pose has six degrees of freedom, and a point
// gives two equations. Chosen by hand; not measured.
constexpr size_t kRefinedPointsMin = 8;
// Error at which a point loses weight. Chosen by hand; not measured.
constexpr double kRefinedErrorPx = 2.0;

// An image as it would be in another frame. Its own points are of the frame that it leaves; how far
// away they are is known in the scale of the new one.
struct CarriedView {
  MapImage image;
  std::vector<SeenDepth> seen;
};

CarriedView CarryOver(const CityMap& map, const MapImage& image, const Sim3& new_from_old) {
  CarriedView carried{image, ListSeenDepths(map, image)};
  carried.image.cam_from_world = TransformCameraWorld(new_from_old, image.cam_from_world);
  carried.image.points.assign(image.points.size(), PointId{});
  for (SeenDepth& seen : carried.seen) seen.depth *= new_from_old.scale;
  return carried;
}

// Moves a view that was carried over to the pose that the points which it is matched with give, as
// far as they agree already: a similarity by few points is right to some pixels only, and what is
// missing is judged to a few.
void RefineView(const CityMap& map, const std::map<FeatureIndex, PointId>& matched,
                double error_px_max, MapImage* view) {
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> positions;
  for (const auto& [feature, id] : matched) {
    const PointRecord* const point = map.FindPoint(id);
    if (point == nullptr ||
        ReprojectionErrorPx(view->ViewOf(feature), point->position) > error_px_max)
      continue;
    x.push_back(view->camera.Normalize(view->features->keypoints[feature]));
    positions.push_back(point->position);
  }
  if (x.size() < kRefinedPointsMin) return;
  view->cam_from_world =
      RefinePose(view->cam_from_world, x, positions, kRefinedErrorPx / view->camera.focal_px());
}

// Both sides' images with pairs across the seam, each in the frame of the other side.
class Sides {
 public:
  Sides(const CityMap& map, std::span<const SeamPair> pairs, const Sim3& into_from_other,
        const AgreementOptions& options)
      : map_(map) {
    const Sim3 other_from_into = into_from_other.Inverse();
    std::map<ImageId, std::map<FeatureIndex, PointId>> matched;
    for (const SeamPair& pair : pairs) {
      const MapImage &a = map.image(pair.a), &b = map.image(pair.matches.other);
      if (!into_.contains(a.id)) into_.emplace(a.id, CarryOver(map, a, other_from_into));
      if (!other_.contains(b.id)) other_.emplace(b.id, CarryOver(map, b, into_from_other));
      for (const FeatureMatch& match : pair.matches.matches) {
        if (b.points[match.b].valid()) matched[a.id].try_emplace(match.a, b.points[match.b]);
        if (a.points[match.a].valid()) matched[b.id].try_emplace(match.b, a.points[match.a]);
      }
    }
    for (auto* const side : {&into_, &other_}) {
      for (auto& [id, view] : *side)
        RefineView(map, matched[id], options.point_error_px_max, &view.image);
    }
  }

  bool Explain(const SeamPair& pair, const AgreementOptions& options) const {
    const ImageId a = pair.a, b = pair.matches.other;
    return !IsTurned(map_.image(a), other_.at(b).image, pair.matches, options) &&
           ExplainsPair(map_, map_.image(a), other_.at(b).image, pair.matches, options) &&
           ExplainsPair(map_, into_.at(a).image, map_.image(b), pair.matches, options);
  }

  VisibleStructure CountVisible(const DoubtOptions& options) const {
    VisibleStructure sum;
    AddVisible(into_, IdsOf(other_), options, &sum);
    AddVisible(other_, IdsOf(into_), options, &sum);
    return sum;
  }

 private:
  static std::vector<ImageId> IdsOf(const std::map<ImageId, CarriedView>& images) {
    std::vector<ImageId> ids;
    for (const auto& [id, image] : images) ids.push_back(id);
    return ids;
  }

  void AddVisible(const std::map<ImageId, CarriedView>& views, const std::vector<ImageId>& around,
                  const DoubtOptions& options, VisibleStructure* sum) const {
    const std::vector<PointId> points = map_.PointsSeenBy(around);
    for (const auto& [id, view] : views) {
      const VisibleStructure visible =
          FindVisible(map_, view.image, view.seen, points, options.visibility);
      sum->expected += visible.expected;
      sum->found += visible.found;
      sum->cells += visible.cells;
      sum->missing_cells += visible.missing_cells;
    }
  }

  const CityMap& map_;
  std::map<ImageId, CarriedView> into_, other_;
};

// Appends the stored pairs of `image` with images of the reconstruction, loaded.
Status AppendStored(MapLoader* loader, const CityMap& map, ImageId image, ReconstructionId wanted,
                    std::map<std::pair<ImageId, ImageId>, PairMatches>* pairs) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          loader->snapshot().ListNeighbors(image));
  for (const PairNeighbor& neighbor : neighbors) {
    VEDUTA_RETURN_IF_ERROR(loader->LoadImages({&neighbor.image, 1}));
    if (!map.HasImage(neighbor.image) || map.image(neighbor.image).reconstruction != wanted)
      continue;
    VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored, loader->GetPair(image, neighbor.image));
    pairs->try_emplace({image, neighbor.image}, MatchesFrom(stored, image));
  }
  return Status::Ok();
}

}  // namespace

bool SeamEvidence::Holds(const DoubtOptions& options) const {
  return agreeing_pairs >= options.seam_pairs_min &&
         static_cast<double>(contradicting_matches) <=
             options.seam_contradiction_share_max * static_cast<double>(agreeing_matches) &&
         (visible.missing_cells < options.missing_cells_min ||
          visible.missing_share() <= options.seam_missing_share_max);
}

std::string SeamEvidence::Text() const {
  return std::to_string(agreeing_pairs) + " pairs agree, " + std::to_string(contradicting_pairs) +
         " contradict; " + MissingText(visible);
}

Result<std::vector<SeamPair>> ListSeamPairs(MapLoader* loader, const CityMap& map, ImageId photo,
                                            std::span<const PairMatches> pairs,
                                            std::span<const ImageId> near, ReconstructionId other) {
  const ReconstructionId own = map.image(photo).reconstruction;
  std::map<std::pair<ImageId, ImageId>, PairMatches> found;
  for (const PairMatches& pair : pairs) {
    if (map.HasImage(pair.other) && map.image(pair.other).reconstruction == other)
      found[{photo, pair.other}] = pair;
  }
  for (const ImageId image : near) {
    if (image != photo) VEDUTA_RETURN_IF_ERROR(AppendStored(loader, map, image, other, &found));
  }
  std::set<ImageId> across;
  for (const auto& [ids, pair] : found) across.insert(ids.second);
  for (const ImageId image : across) {
    std::map<std::pair<ImageId, ImageId>, PairMatches> back;
    VEDUTA_RETURN_IF_ERROR(AppendStored(loader, map, image, own, &back));
    for (const auto& [ids, pair] : back)
      found.try_emplace({ids.second, ids.first}, MatchesFrom(RecordOf(pair, image), ids.second));
  }
  std::set<ImageId> images;
  std::vector<SeamPair> list;
  for (auto& [ids, pair] : found) {
    images.insert({ids.first, ids.second});
    list.push_back({ids.first, std::move(pair)});
  }
  VEDUTA_RETURN_IF_ERROR(loader->LoadNeighborhood(std::vector(images.begin(), images.end())));
  return list;
}

SeamEvidence JudgeSeam(const CityMap& map, std::span<const SeamPair> pairs,
                       const Sim3& into_from_other, const MapperOptions& options) {
  const Sides sides(map, pairs, into_from_other, options.agreement);
  SeamEvidence evidence;
  for (const SeamPair& pair : pairs) {
    if (pair.matches.geometry == PairGeometry::kRotation) continue;
    const bool agrees = sides.Explain(pair, options.agreement);
    ++(agrees ? evidence.agreeing_pairs : evidence.contradicting_pairs);
    (agrees ? evidence.agreeing_matches : evidence.contradicting_matches) +=
        std::min<size_t>(pair.matches.matches.size(), options.doubt.pair_weight_max);
  }
  evidence.visible = sides.CountVisible(options.doubt);
  return evidence;
}

}  // namespace veduta
