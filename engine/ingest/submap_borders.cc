// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/submap_borders.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// Ties with one other submap, at most. Points that both see and matches whose two points are not
// one are ranked as one list: where twice as many of the former were taken, which agree with the
// map as it is, the relaxation of a street could not leave a place 13 m off. Chosen by hand.
constexpr size_t kTiesMax = 60;
// Views of one tie from one submap, at most: further views hardly tell more exactly where the place
// is. Chosen by hand; not measured.
constexpr size_t kViewsMax = 4;

// A point as it is seen from this submap and from another, or two points that a match says are one.
struct Candidate {
  std::vector<TrackElement> here, there;
  uint64_t hash = 0;

  // Ties of greater worth are taken first. It is the number of views on the side that has fewer:
  // that side limits how exactly the tie tells how the two submaps lie.
  size_t Worth() const { return std::min({here.size(), there.size(), kViewsMax}); }
};

class BorderFinder {
 public:
  BorderFinder(const MappingContext& context, const Submaps& submaps, const SubmapRecord& submap)
      : context_(context), map_(*context.map), submaps_(submaps), submap_(submap) {}

  Status Find(const Healing& healing, SubmapBorder* border) {
    AddPoints();
    for (const ImageId id : submap_.images) VEDUTA_RETURN_IF_ERROR(AddMatches(id));
    for (auto& [other, candidates] : candidates_) Take(&candidates, border);
    AddFragments(healing, border);
    AddEvidence(healing, border);
    return Status::Ok();
  }

 private:
  bool IsHere(ImageId id) const { return std::ranges::binary_search(submap_.images, id); }
  // The submap that the image is in; not valid() where it is in none.
  SubmapId SubmapOf(ImageId id) const {
    const SubmapRecord* const found = submaps_.FindOf(id);
    return found == nullptr || found->reconstruction != submap_.reconstruction ? SubmapId()
                                                                               : found->id;
  }
  std::vector<TrackElement> ViewsIn(PointId point, SubmapId submap) const {
    std::vector<TrackElement> views = map_.point(point).track;
    std::erase_if(views, [&](const TrackElement& e) { return SubmapOf(e.image) != submap; });
    return views;
  }

  // Adds each point that this submap and others see, as a tie with the other submap that sees it
  // from most images.
  void AddPoints() {
    for (const PointId point : map_.PointsSeenBy(submap_.images)) {
      std::map<SubmapId, size_t> seen;
      for (const TrackElement& e : map_.point(point).track) {
        const SubmapId other = SubmapOf(e.image);
        if (other.valid() && other != submap_.id) ++seen[other];
      }
      if (seen.empty()) continue;
      const SubmapId other =
          std::ranges::max_element(seen, {}, [](const auto& entry) { return entry.second; })->first;
      candidates_[other].push_back({ViewsIn(point, submap_.id), ViewsIn(point, other),
                                    MixSeed(point.home.value, point.ordinal)});
    }
  }

  // Adds ties for those matches of the image with other submaps whose two features see different
  // points.
  Status AddMatches(ImageId id) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                            context_.loader->snapshot().ListNeighbors(id));
    const MapImage& image = map_.image(id);
    for (const PairNeighbor& neighbor : neighbors) {
      const SubmapId other = SubmapOf(neighbor.image);
      if (!other.valid() || other == submap_.id || !map_.HasImage(neighbor.image)) continue;
      VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored,
                              context_.loader->GetPair(id, neighbor.image));
      const MapImage& beside = map_.image(neighbor.image);
      for (const FeatureMatch& match : MatchesFrom(stored, id).matches)
        AddMatch(image.points[match.a], beside.points[match.b], other);
    }
    return Status::Ok();
  }

  void AddMatch(PointId a, PointId b, SubmapId other) {
    if (!a.valid() || !b.valid() || a == b || !matched_.insert({a, b}).second) return;
    const PointRecord *const here = map_.FindPoint(a), *const there = map_.FindPoint(b);
    // One image that sees both says that they are two.
    if (here == nullptr || there == nullptr || map_.SharesImage(*here, *there)) return;
    Candidate candidate{
        ViewsIn(a, submap_.id), ViewsIn(b, other),
        MixSeed(MixSeed(a.home.value, a.ordinal), MixSeed(b.home.value, b.ordinal))};
    if (candidate.here.size() >= 2 && candidate.there.size() >= 2)
      candidates_[other].push_back(std::move(candidate));
  }

  void Take(std::vector<Candidate>* candidates, SubmapBorder* border) const {
    std::ranges::sort(*candidates, [](const Candidate& x, const Candidate& y) {
      return x.Worth() != y.Worth() ? x.Worth() > y.Worth() : x.hash < y.hash;
    });
    if (candidates->size() > kTiesMax) candidates->resize(kTiesMax);
    for (const Candidate& candidate : *candidates) {
      std::vector<BorderView> views;
      const uint32_t tie = border->views.empty() ? 0 : border->views.back().tie + 1;
      for (const auto* side : {&candidate.here, &candidate.there}) {
        // The views that are taken are spread evenly over all views of this side.
        const size_t count = std::min(side->size(), kViewsMax);
        for (size_t i = 0; i < count; ++i) {
          const TrackElement& e = (*side)[i * side->size() / count];
          const Keypoint& seen = map_.image(e.image).features->keypoints[e.feature];
          views.push_back({tie, e.image, seen.x_px, seen.y_px});
        }
      }
      std::ranges::sort(views, {}, &BorderView::image);
      border->views.insert(border->views.end(), views.begin(), views.end());
    }
  }

  // The images of this submap that lie in one agreeing part are a fragment, named by its first
  // image, the head. Every other image is a fragment of its own.
  void AddFragments(const Healing& healing, SubmapBorder* border) {
    for (const ImageId id : submap_.images) head_of_[id] = id;
    for (const std::vector<ImageId>& part : healing.agreeing) {
      ImageId head;
      for (const ImageId id : part) {
        if (!IsHere(id)) continue;
        if (!head.valid()) head = id;
        head_of_[id] = head;
      }
    }
    for (const auto& [image, head] : head_of_) border->fragments.push_back({image, head});
  }

  void AddEvidence(const Healing& healing, SubmapBorder* border) const {
    std::map<std::pair<ImageId, ImageId>, BorderEvidence> sums;
    for (const PairEvidence& pair : healing.evidence) {
      const auto a = head_of_.find(pair.a), b = head_of_.find(pair.b);
      if (a == head_of_.end() && b == head_of_.end()) continue;
      const bool is_inside = a != head_of_.end() && b != head_of_.end();
      ImageId own = a != head_of_.end() ? a->second : b->second;
      ImageId other = is_inside ? b->second : (a != head_of_.end() ? pair.b : pair.a);
      if (is_inside && other < own) std::swap(own, other);
      if (own == other || (!is_inside && !SubmapOf(other).valid())) continue;
      BorderEvidence& sum = sums[{own, other}];
      sum.a = own, sum.b = other;
      sum.shared_points += pair.shared_points;
      sum.agreeing_matches += pair.agreeing_matches;
      sum.contradicting_matches += pair.contradicting_matches;
      sum.turned_matches += pair.turned_matches;
    }
    for (const auto& [key, sum] : sums) border->evidence.push_back(sum);
  }

  const MappingContext& context_;
  const CityMap& map_;
  const Submaps& submaps_;
  const SubmapRecord& submap_;
  std::map<ImageId, ImageId> head_of_;
  std::set<std::pair<PointId, PointId>> matched_;
  std::map<SubmapId, std::vector<Candidate>> candidates_;
};

}  // namespace

Result<SubmapBorder> FindBorder(const MappingContext& context, const Submaps& submaps, SubmapId id,
                                const Healing& healing) {
  SubmapBorder border;
  border.id = id;
  BorderFinder finder(context, submaps, *submaps.Find(id));
  VEDUTA_RETURN_IF_ERROR(finder.Find(healing, &border));
  return border;
}

Result<std::vector<SubmapBorder>> FindBorders(const MappingContext& context, const Submaps& submaps,
                                              ReconstructionId reconstruction,
                                              const Healing& healing) {
  const std::vector<SubmapId> ids = submaps.List(reconstruction);
  // What concerns each submap, for a look through all of it would take the square of the city.
  std::map<SubmapId, Healing> of_submap;
  for (const SubmapId id : ids) of_submap[id].agreeing = healing.agreeing;
  for (const PairEvidence& pair : healing.evidence) {
    const SubmapRecord *const a = submaps.FindOf(pair.a), *const b = submaps.FindOf(pair.b);
    if (a != nullptr && of_submap.contains(a->id)) of_submap[a->id].evidence.push_back(pair);
    if (b != nullptr && b != a && of_submap.contains(b->id))
      of_submap[b->id].evidence.push_back(pair);
  }
  std::vector<Result<SubmapBorder>> found(ids.size(), SubmapBorder());
  context.pool->ParallelFor(ids.size(), [&](size_t i) {
    found[i] = FindBorder(context, submaps, ids[i], of_submap.at(ids[i]));
  });
  std::vector<SubmapBorder> borders;
  for (Result<SubmapBorder>& border : found) {
    VEDUTA_RETURN_IF_ERROR(border.status());
    borders.push_back(*std::move(border));
  }
  return borders;
}

}  // namespace veduta
