// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/mixed_places.h"

#include <algorithm>
#include <set>
#include <utility>

#include "engine/ingest/doubt.h"
#include "engine/mapping/covisible_images.h"
#include "engine/mapping/two_sides.h"
#include "engine/mapping/visibility.h"

namespace veduta {
namespace {

// Two images contradict each other where one lacks what the other sees. By their order.
std::vector<WeightedTie> ListContradictions(const MappingContext& context,
                                            std::span<const ImageId> images) {
  const std::vector<PointId> points = context.map->PointsSeenBy(images);
  const CityMap& map = *context.map;
  const DoubtOptions& options = context.options.doubt;
  std::vector<std::vector<VisibleStructure>> visible(images.size());
  context.pool->ParallelFor(images.size(), [&](size_t i) {
    const MapImage& view = map.image(images[i]);
    visible[i] =
        FindVisibleOfEach(map, view, ListSeenDepths(map, view), points, images, options.visibility);
  });
  const auto lacking = [&](uint32_t a, uint32_t b) {
    return IsOfAnotherPlace(visible[a][b], options) ? visible[a][b].missing_cells : 0;
  };
  std::vector<WeightedTie> contradictions;
  for (uint32_t a = 0; a < images.size(); ++a) {
    for (uint32_t b = a + 1; b < images.size(); ++b) {
      if (const uint32_t weight = lacking(a, b) + lacking(b, a); weight > 0)
        contradictions.push_back({a, b, weight});
    }
  }
  return contradictions;
}

// Images that are compared each with each, at most. Chosen by hand; not measured.
constexpr size_t kComparedMax = 64;

// Groups of as many images, of which each shares points with others of its group where it can: two
// places that were taken for one lie in one group. A group takes over half of the one before it, so
// that what lies at the border of two is whole in one of them. Ascending.
std::vector<std::vector<ImageId>> GroupNear(const CityMap& map, std::span<const ImageId> images) {
  if (images.size() <= kComparedMax) return {std::vector<ImageId>(images.begin(), images.end())};
  std::vector<ImageId> order;
  std::set<ImageId> met;
  const auto meet = [&](ImageId id) {
    if (met.insert(id).second) order.push_back(id);
  };
  size_t at = 0;
  for (const ImageId start : images) {
    for (meet(start); at < order.size(); ++at)
      std::ranges::for_each(CovisibleImages(map, order[at], images.size(), images), meet);
  }
  std::vector<std::vector<ImageId>> groups;
  constexpr size_t kStep = kComparedMax / 2;
  for (size_t first = 0; first + kStep < order.size(); first += kStep) {
    const size_t end = std::min(first + kComparedMax, order.size());
    std::vector<ImageId>& group = groups.emplace_back(order.begin() + static_cast<ptrdiff_t>(first),
                                                      order.begin() + static_cast<ptrdiff_t>(end));
    std::ranges::sort(group);
  }
  return groups;
}

// Images of each of two places that contradict some of the other one, at least: a photo or two that
// see less than others do not make a place. Chosen by hand; not measured.
constexpr size_t kOfAPlaceMin = 3;

// Whether the contradictions part the images in two, rather than to speak against a few of them.
bool AreTwo(std::span<const WeightedTie> contradictions, const std::vector<bool>& sides,
            const DoubtOptions& options) {
  std::set<uint32_t> of_a_side[2];
  size_t across = 0;
  for (const WeightedTie& tie : contradictions) {
    if (sides[tie.a] == sides[tie.b]) continue;
    ++across;
    for (const uint32_t i : {tie.a, tie.b}) of_a_side[sides[i]].insert(i);
  }
  const size_t within = contradictions.size() - across;
  const double within_max = options.mixed_within_share_max * static_cast<double>(across);
  return across >= options.mixed_pairs_min &&
         std::min(of_a_side[0].size(), of_a_side[1].size()) >= kOfAPlaceMin &&
         static_cast<double>(within) <= within_max;
}

// Whether so many verified pairs agree across that the contradictions are what any large place has.
bool IsHeldTogether(std::span<const WeightedTie> contradictions,
                    std::span<const WeightedTie> agreements, const std::vector<bool>& sides,
                    const DoubtOptions& options) {
  const auto across = [&](const WeightedTie& tie) { return sides[tie.a] != sides[tie.b]; };
  return static_cast<double>(std::ranges::count_if(contradictions, across)) <=
         options.mixed_agreeing_share_max *
             static_cast<double>(std::ranges::count_if(agreements, across));
}

Result<std::vector<ImageId>> ListMembers(const Snapshot& snapshot, ReconstructionId id) {
  std::vector<ImageId> members;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    if (pose.reconstruction == id) members.push_back(pose.image);
    return true;
  }));
  std::ranges::sort(members);
  return members;
}

// Verified pairs of the members that do not contradict each other. By the order of the members.
Result<std::vector<WeightedTie>> ListAgreements(const Snapshot& snapshot,
                                                std::span<const ImageId> members,
                                                std::span<const WeightedTie> contradictions) {
  std::set<std::pair<uint32_t, uint32_t>> contradicting;
  for (const WeightedTie& tie : contradictions) contradicting.emplace(tie.a, tie.b);
  std::vector<WeightedTie> agreements;
  for (uint32_t a = 0; a < members.size(); ++a) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                            snapshot.ListNeighbors(members[a]));
    for (const PairNeighbor& neighbor : neighbors) {
      const auto found = std::ranges::lower_bound(members, neighbor.image);
      if (neighbor.image <= members[a] || found == members.end() || *found != neighbor.image)
        continue;
      const auto b = static_cast<uint32_t>(found - members.begin());
      if (!contradicting.contains({a, b})) agreements.push_back({a, b, neighbor.match_count});
    }
  }
  return agreements;
}

// FindOtherPlace by images that are compared each with each.
Result<std::vector<ImageId>> FindOtherPlaceBy(const MappingContext& context,
                                              std::span<const ImageId> images) {
  std::vector<WeightedTie> contradictions = ListContradictions(context, images);
  const std::vector<bool> parted = PartInTwo(images.size(), contradictions, {});
  if (!AreTwo(contradictions, parted, context.options.doubt)) return std::vector<ImageId>();
  const Snapshot& snapshot = context.loader->snapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> members,
                          ListMembers(snapshot, context.map->image(images.front()).reconstruction));
  const auto index_of = [&](uint32_t i) {
    return static_cast<uint32_t>(std::ranges::lower_bound(members, images[i]) - members.begin());
  };
  for (WeightedTie& tie : contradictions) tie.a = index_of(tie.a), tie.b = index_of(tie.b);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<WeightedTie> agreements,
                          ListAgreements(snapshot, members, contradictions));
  const std::vector<bool> sides = PartInTwo(members.size(), contradictions, agreements);
  if (IsHeldTogether(contradictions, agreements, sides, context.options.doubt))
    return std::vector<ImageId>();
  const auto of_first = static_cast<size_t>(std::ranges::count(sides, sides.front()));
  const bool part_is_of_first = 2 * of_first < members.size();
  std::vector<ImageId> part;
  for (size_t i = 0; i < members.size(); ++i) {
    if ((sides[i] == sides.front()) == part_is_of_first) part.push_back(members[i]);
  }
  return part;
}

}  // namespace

Result<std::vector<ImageId>> FindOtherPlace(const MappingContext& context,
                                            std::span<const ImageId> images) {
  for (const std::vector<ImageId>& group : GroupNear(*context.map, images)) {
    VEDUTA_ASSIGN_OR_RETURN(std::vector<ImageId> part, FindOtherPlaceBy(context, group));
    if (!part.empty()) return part;
  }
  return std::vector<ImageId>();
}

}  // namespace veduta
