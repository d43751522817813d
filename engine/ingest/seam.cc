// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/seam.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "engine/ingest/doubt.h"
#include "engine/ingest/uncertain_lenses.h"
#include "engine/mapping/resection.h"
#include "engine/mapping/similarity.h"
#include "storage/base/median.h"

namespace veduta {
namespace {

// Points that a carried view is moved by, at least: a pose has six degrees of freedom, and a point
// gives two equations. Chosen by hand; not measured.
constexpr size_t kRefinedPointsMin = 8;
// Images of one side of a seam that a hypothesis remembers: as many as a merge is sought around
// when a photo is placed (MapperOptions::local_images_max). Chosen by hand; not measured.
constexpr size_t kSeamImagesMax = 12;
// Error at which a point loses weight. Chosen by hand; not measured.
constexpr double kRefinedErrorPx = 2.0;
// A view is moved to points that are found within so many times the radius by which it lacks
// structure, one after the other. On a street of 150 (--seed 205) 15 photos stayed apart whose
// place was off by 6 to 17 cm, which is 12 px and more of a house at 4 m. Chosen by hand.
constexpr double kSoughtTimes[] = {4, 2};
// A point loses weight at an error of the radius over this. Chosen by hand; not measured.
constexpr double kErrorsWithin = 3;
// Images that a jackknife leaves out, one at a time. Chosen by hand; not measured.
constexpr size_t kWitnessesMax = 24;
// Images of either side that are asked what they see, beside those of the pairs. Chosen by hand;
// not measured.
constexpr size_t kBesideMax = 24;

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

// Moves a view to where the points that it must see are found, sought within `radius_px` of where
// they should be. A view that few points carry over may be off by more pixels than what is missing
// is judged to; a view that shows another place finds a few points by chance, and goes nowhere.
void MoveToFound(const CityMap& map, const CarriedView& view, std::span<const PointId> points,
                 VisibilityOptions options, double radius_px, MapImage* moved) {
  options.search_radius_px = radius_px;
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> positions;
  for (const ExpectedPoint& point : ListExpected(map, *moved, view.seen, points, options)) {
    if (!point.found) continue;
    x.push_back(moved->camera.Normalize(moved->features->keypoints[*point.found]));
    positions.push_back(map.point(point.point).position);
  }
  if (x.size() < kRefinedPointsMin) return;
  moved->cam_from_world = RefinePose(moved->cam_from_world, x, positions,
                                     radius_px / kErrorsWithin / moved->camera.focal_px());
}

// What a view that was carried over sees, and lacks, of `points`: where it lacks some, at the pose
// near by at which it lacks least, where it is moved to.
VisibleStructure SeeAtBest(const CityMap& map, std::span<const PointId> points,
                           const VisibilityOptions& options, CarriedView* carried) {
  const CarriedView& view = *carried;
  VisibleStructure best = FindVisible(map, view.image, view.seen, points, options);
  if (best.missing_cells == 0) return best;
  MapImage moved = view.image;
  for (const double times : kSoughtTimes)
    MoveToFound(map, view, points, options, times * options.search_radius_px, &moved);
  const VisibleStructure there = FindVisible(map, moved, view.seen, points, options);
  const bool is_asked_as_much = 2 * there.cells >= best.cells;
  if (!is_asked_as_much || there.missing_share() >= best.missing_share()) return best;
  carried->image.cam_from_world = moved.cam_from_world;
  return there;
}

// Both sides' images near the seam, each in the frame of the other side.
class Sides {
 public:
  Sides(const CityMap& map, const SeamArea& seam, const Sim3& into_from_other,
        const AgreementOptions& options)
      : map_(map), seam_(seam) {
    const Sim3 other_from_into = into_from_other.Inverse();
    for (const ImageId id : seam.into)
      into_.emplace(id, CarryOver(map, map.image(id), other_from_into));
    for (const ImageId id : seam.other)
      other_.emplace(id, CarryOver(map, map.image(id), into_from_other));
    std::map<ImageId, std::map<FeatureIndex, PointId>> matched;
    for (const SeamPair& pair : seam.pairs) {
      const MapImage &a = map.image(pair.a), &b = map.image(pair.matches.other);
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
    const bool is_uncertain = seam_.uncertain.contains(a) || seam_.uncertain.contains(b);
    return !IsTurned(map_.image(a), other_.at(b).image, pair.matches,
                     is_uncertain ? OfUncertainLenses(options) : options) &&
           ExplainsPair(map_, map_.image(a), other_.at(b).image, pair.matches, options) &&
           ExplainsPair(map_, into_.at(a).image, map_.image(b), pair.matches, options);
  }

  void CountVisible(const DoubtOptions& options, SeamEvidence* evidence) {
    AddVisible(seam_.other, options, &into_, evidence);
    AddVisible(seam_.into, options, &other_, evidence);
  }

  void CountMixed(const DoubtOptions& options, SeamEvidence* evidence) const {
    std::set<std::pair<ImageId, ImageId>> pairs;
    const auto add = [&](const std::map<ImageId, CarriedView>& views,
                         const std::vector<ImageId>& others, bool is_into) {
      const std::vector<PointId> points = map_.PointsSeenBy(others);
      for (const auto& [id, view] : views) {
        const std::vector<VisibleStructure> visible =
            FindVisibleOfEach(map_, view.image, view.seen, points, others, options.seam_visibility);
        for (size_t i = 0; i < others.size(); ++i) {
          if (!IsOfAnotherPlace(visible[i], options)) continue;
          pairs.insert(is_into ? std::pair(id, others[i]) : std::pair(others[i], id));
        }
      }
    };
    add(into_, seam_.other, true);
    add(other_, seam_.into, false);
    evidence->mixed_pairs = static_cast<uint32_t>(pairs.size());
    evidence->compared_pairs = static_cast<uint32_t>(into_.size() * other_.size());
  }

 private:
  // Of images that miss enough cells to count, the one that misses the larger share; of others the
  // one that misses more.
  static bool IsWorse(const VisibleStructure& one, const VisibleStructure& other,
                      const DoubtOptions& options) {
    const bool counts = one.missing_cells >= options.seam_view_missing_cells_min,
               other_counts = other.missing_cells >= options.seam_view_missing_cells_min;
    if (counts != other_counts) return counts;
    return counts ? one.missing_share() > other.missing_share()
                  : one.missing_cells > other.missing_cells;
  }

  void AddVisible(const std::vector<ImageId>& around, const DoubtOptions& options,
                  std::map<ImageId, CarriedView>* views, SeamEvidence* evidence) {
    const std::vector<PointId> points = map_.PointsSeenBy(around);
    VisibleStructure& sum = evidence->visible;
    for (auto& [id, view] : *views) {
      const VisibleStructure visible = SeeAtBest(map_, points, options.seam_visibility, &view);
      sum.expected += visible.expected;
      sum.found += visible.found;
      sum.cells += visible.cells;
      sum.missing_cells += visible.missing_cells;
      if (IsWorse(visible, evidence->worst, options)) evidence->worst = visible;
    }
  }

  const CityMap& map_;
  const SeamArea& seam_;
  std::map<ImageId, CarriedView> into_, other_;
};

// The images of the other side that have pairs, with the median of how far each sees in its frame.
std::vector<std::pair<ImageId, double>> ListReaches(const CityMap& map, const SeamArea& seam) {
  std::set<ImageId> images;
  for (const SeamPair& pair : seam.pairs) images.insert(pair.matches.other);
  std::vector<std::pair<ImageId, double>> reaches;
  for (const ImageId id : images) {
    std::vector<double> depths;
    for (const SeenDepth& seen : ListSeenDepths(map, map.image(id))) depths.push_back(seen.depth);
    if (!depths.empty()) reaches.emplace_back(id, MedianOf(std::move(depths)));
  }
  return reaches;
}

// The images with most matches, at most so many; ascending.
std::vector<ImageId> MostMatched(const std::map<ImageId, size_t>& matches, size_t count_max) {
  std::vector<std::pair<ImageId, size_t>> ranked(matches.begin(), matches.end());
  std::ranges::stable_sort(ranked, std::greater<>(), &std::pair<ImageId, size_t>::second);
  if (ranked.size() > count_max) ranked.resize(count_max);
  std::vector<ImageId> images;
  for (const auto& [image, count] : ranked) images.push_back(image);
  std::ranges::sort(images);
  return images;
}

// The images of the pairs that have most matches across; ascending.
std::vector<ImageId> ListWitnesses(std::span<const SeamPair> pairs) {
  std::map<ImageId, size_t> matches;
  for (const SeamPair& pair : pairs) {
    matches[pair.a] += pair.matches.matches.size();
    matches[pair.matches.other] += pair.matches.matches.size();
  }
  return MostMatched(matches, kWitnessesMax);
}

// SeamEvidence::jackknife_share. Cameras that look down a street see the same far houses from both
// ends: these houses agree with the similarity and hardly say where the one end is. And a photo
// that takes one window for another is wrong in all its pairs alike.
double MeasureJackknife(const CityMap& map, const SeamArea& seam, const Sim3& into_from_other) {
  const std::vector<std::pair<ImageId, double>> reaches = ListReaches(map, seam);
  const std::vector<ImageId> witnesses = ListWitnesses(seam.pairs);
  if (reaches.empty() || witnesses.empty()) return std::numeric_limits<double>::infinity();
  double worst = 0;
  for (const ImageId left_out : witnesses) {
    SeamArea rest;
    std::ranges::copy_if(seam.pairs, std::back_inserter(rest.pairs), [&](const SeamPair& pair) {
      return pair.a != left_out && pair.matches.other != left_out;
    });
    const CrossSightings seen = ListCrossSightings(map, rest);
    const Sim3 moved = RefineSeam(seen, into_from_other);
    const SimilarityCovariance covariance =
        CovarianceOf(moved, seen.in_into, seen.in_other, kRefinedErrorPx);
    std::vector<double> shares;
    for (const auto& [id, reach] : reaches) {
      const Eigen::Vector3d center = map.image(id).cam_from_world.Center();
      const double by = (moved * center - into_from_other * center).norm();
      const double unsure = covariance.PositionDeviation(moved * center);
      if (!std::isfinite(by) || !std::isfinite(unsure))
        return std::numeric_limits<double>::infinity();
      shares.push_back(std::max(by, unsure) / (into_from_other.scale * reach));
    }
    worst = std::max(worst, MedianOf(std::move(shares)));
  }
  return worst;
}

// `images`, with the images of their reconstruction that share most points with them.
std::vector<ImageId> WithBeside(const CityMap& map, const std::set<ImageId>& images) {
  std::map<ImageId, size_t> shared;
  for (const PointId id : map.PointsSeenBy(std::vector(images.begin(), images.end()))) {
    for (const TrackElement& element : map.point(id).track) ++shared[element.image];
  }
  std::vector<std::pair<size_t, ImageId>> ranked;
  for (const auto& [id, count] : shared) {
    if (!images.contains(id)) ranked.emplace_back(count, id);
  }
  std::ranges::sort(ranked, [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  std::set<ImageId> all = images;
  for (size_t i = 0; i < std::min(ranked.size(), kBesideMax); ++i) all.insert(ranked[i].second);
  return {all.begin(), all.end()};
}

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

// The pairs that the similarity explains, or the others.
std::vector<SeamPair> PairsThat(bool agree, const CityMap& map, const SeamArea& seam,
                                const Sim3& into_from_other, const MapperOptions& options) {
  const Sides sides(map, seam, into_from_other, options.agreement);
  std::vector<SeamPair> pairs;
  std::ranges::copy_if(seam.pairs, std::back_inserter(pairs), [&](const SeamPair& pair) {
    return sides.Explain(pair, options.agreement) == agree;
  });
  return pairs;
}

std::string PlaceText(double jackknife_share) {
  if (!std::isfinite(jackknife_share)) return "without one photo nothing says where they meet";
  char text[100];
  std::snprintf(text, sizeof(text),
                "without one photo the cameras move by up to %.2g %% of how far they see",
                100 * jackknife_share);
  return text;
}

}  // namespace

std::optional<RefusalReason> SeamEvidence::Refusal(const DoubtOptions& options) const {
  if (agreeing_pairs < options.seam_pairs_min) return RefusalReason::kFewPairs;
  const double contradiction_share_max = IsConfirmed(visible, options)
                                             ? options.seam_confirmed_contradiction_share_max
                                             : options.seam_contradiction_share_max;
  if (static_cast<double>(contradicting_matches) >
      contradiction_share_max * static_cast<double>(agreeing_matches))
    return RefusalReason::kContradicted;
  if (LacksStructure(options, options.seam_mixed_share_max))
    return RefusalReason::kMissingStructure;
  if (jackknife_share && !(*jackknife_share <= options.seam_jackknife_share_max))
    return RefusalReason::kUndetermined;
  return std::nullopt;
}

bool SeamEvidence::LacksStructure(const DoubtOptions& options, double mixed_share_max) const {
  return (visible.missing_cells >= options.missing_cells_min &&
          visible.missing_share() > options.seam_missing_share_max) ||
         (worst.missing_cells >= options.seam_view_missing_cells_min &&
          worst.missing_share() > options.seam_view_missing_share_max) ||
         (mixed_pairs >= options.seam_mixed_pairs_min &&
          mixed_pairs > mixed_share_max * compared_pairs);
}

std::string SeamEvidence::Text() const {
  return std::to_string(agreeing_pairs) + " pairs agree, " + std::to_string(contradicting_pairs) +
         " contradict; " + MissingText(visible) + ", and " + std::to_string(worst.missing_cells) +
         " of " + std::to_string(worst.cells) + " of the photo that lacks most" +
         (mixed_pairs > 0
              ? "; " + std::to_string(mixed_pairs) + " of " + std::to_string(compared_pairs) +
                    " pairs of photos lack what the other one sees"
              : "") +
         (jackknife_share ? "; " + PlaceText(*jackknife_share) : "");
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
    const bool has_stored_pairs = image != photo || pairs.empty();
    if (has_stored_pairs) VEDUTA_RETURN_IF_ERROR(AppendStored(loader, map, image, other, &found));
  }
  std::set<ImageId> across;
  for (const auto& [ids, pair] : found) across.insert(ids.second);
  for (const ImageId image : across) {
    std::map<std::pair<ImageId, ImageId>, PairMatches> back;
    VEDUTA_RETURN_IF_ERROR(AppendStored(loader, map, image, own, &back));
    for (const auto& [ids, pair] : back)
      found.try_emplace({ids.second, ids.first}, MatchesFrom(RecordOf(pair, image), ids.second));
  }
  std::vector<SeamPair> all;
  for (auto& [ids, pair] : found) all.push_back({ids.first, std::move(pair)});
  return all;
}

Result<SeamArea> FindSeam(MapLoader* loader, const CityMap& map, ImageId photo,
                          std::span<const PairMatches> pairs, std::span<const ImageId> near,
                          ReconstructionId other) {
  SeamArea seam;
  VEDUTA_ASSIGN_OR_RETURN(seam.pairs, ListSeamPairs(loader, map, photo, pairs, near, other));
  std::set<ImageId> images, into, across;
  for (const SeamPair& pair : seam.pairs) {
    images.insert({pair.a, pair.matches.other});
    into.insert(pair.a);
    across.insert(pair.matches.other);
  }
  VEDUTA_RETURN_IF_ERROR(loader->LoadNeighborhood(std::vector(images.begin(), images.end())));
  VEDUTA_ASSIGN_OR_RETURN(seam.uncertain, ListYoungLenses(loader, map, images));
  seam.into = WithBeside(map, into);
  seam.other = WithBeside(map, across);
  VEDUTA_RETURN_IF_ERROR(loader->LoadNeighborhood(seam.into));
  VEDUTA_RETURN_IF_ERROR(loader->LoadNeighborhood(seam.other));
  return seam;
}

CrossSightings ListCrossSightings(const CityMap& map, const SeamArea& seam) {
  CrossSightings seen;
  const auto append = [&](const MapImage& view, FeatureIndex feature, PointId id,
                          std::vector<CrossSighting>* into) {
    const PointRecord* const point = id.valid() ? map.FindPoint(id) : nullptr;
    if (point == nullptr) return;
    into->push_back({view.id, view.cam_from_world,
                     view.camera.Normalize(view.features->keypoints[feature]), point->position,
                     view.camera.focal_px()});
  };
  for (const SeamPair& pair : seam.pairs) {
    const MapImage &a = map.image(pair.a), &b = map.image(pair.matches.other);
    for (const FeatureMatch& match : pair.matches.matches) {
      append(a, match.a, b.points[match.b], &seen.in_into);
      append(b, match.b, a.points[match.a], &seen.in_other);
    }
  }
  return seen;
}

Sim3 RefineSeam(const CrossSightings& seen, const Sim3& into_from_other) {
  return RefineSimilarity(into_from_other, seen.in_into, seen.in_other, kRefinedErrorPx);
}

SeamEvidence JudgeSeam(const CityMap& map, const SeamArea& seam, const Sim3& into_from_other,
                       const MapperOptions& options) {
  Sides sides(map, seam, into_from_other, options.agreement);
  SeamEvidence evidence;
  for (const SeamPair& pair : seam.pairs) {
    if (pair.matches.geometry == PairGeometry::kRotation) continue;
    const bool agrees = sides.Explain(pair, options.agreement);
    ++(agrees ? evidence.agreeing_pairs : evidence.contradicting_pairs);
    (agrees ? evidence.agreeing_matches : evidence.contradicting_matches) +=
        std::min<size_t>(pair.matches.matches.size(), options.doubt.pair_weight_max);
  }
  sides.CountVisible(options.doubt, &evidence);
  if (!evidence.Refusal(options.doubt)) sides.CountMixed(options.doubt, &evidence);
  if (!evidence.Refusal(options.doubt))
    evidence.jackknife_share = MeasureJackknife(map, seam, into_from_other);
  return evidence;
}

SeamEvidence AskPictures(const CityMap& map, const SeamArea& seam, const Sim3& into_from_other,
                         const MapperOptions& options) {
  Sides sides(map, seam, into_from_other, options.agreement);
  SeamEvidence evidence;
  sides.CountVisible(options.doubt, &evidence);
  sides.CountMixed(options.doubt, &evidence);
  return evidence;
}

std::vector<SeamPair> PairsFor(const CityMap& map, const SeamArea& seam,
                               const Sim3& into_from_other, const MapperOptions& options) {
  return PairsThat(true, map, seam, into_from_other, options);
}

std::vector<SeamPair> PairsAgainst(const CityMap& map, const SeamArea& seam,
                                   const Sim3& into_from_other, const MapperOptions& options) {
  return PairsThat(false, map, seam, into_from_other, options);
}

std::vector<ImageId> SeamImages(std::span<const SeamPair> pairs) {
  std::map<ImageId, size_t> own, other;  // matches across
  for (const SeamPair& pair : pairs) {
    own[pair.a] += pair.matches.matches.size();
    other[pair.matches.other] += pair.matches.matches.size();
  }
  std::vector<ImageId> images = MostMatched(own, kSeamImagesMax);
  const std::vector<ImageId> across = MostMatched(other, kSeamImagesMax);
  images.insert(images.end(), across.begin(), across.end());
  std::ranges::sort(images);
  return images;
}

HypothesisRecord HypothesisOf(ReconstructionId own, ReconstructionId other,
                              const Sim3& own_from_other, const SeamEvidence& evidence,
                              RefusalReason reason) {
  HypothesisRecord hypothesis;
  hypothesis.a = std::min(own, other);
  hypothesis.b = std::max(own, other);
  hypothesis.a_from_b = own < other ? own_from_other : own_from_other.Inverse();
  hypothesis.reason = reason;
  hypothesis.agreeing_pairs = evidence.agreeing_pairs;
  hypothesis.contradicting_pairs = evidence.contradicting_pairs;
  hypothesis.agreeing_matches = evidence.agreeing_matches;
  hypothesis.contradicting_matches = evidence.contradicting_matches;
  hypothesis.judged_cells = evidence.visible.cells;
  hypothesis.missing_cells = evidence.visible.missing_cells;
  return hypothesis;
}

}  // namespace veduta
