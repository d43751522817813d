// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/doubt.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>

#include "engine/ingest/surroundings.h"
#include "engine/ingest/uncertain_lenses.h"
#include "engine/mapping/neighbor_agreement.h"
#include "engine/mapping/sure_visibility.h"
#include "storage/base/angle.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

using Judgements = std::map<ImageId, VisibleStructure>;

// Judges these images anew, side by side, by what `known` see.
void Judge(const MappingContext& context, std::span<const ImageId> images,
           std::span<const ImageId> known, Judgements* judged) {
  const CityMap& map = *context.map;
  const DoubtOptions& options = context.options.doubt;
  std::vector<VisibleStructure> visible(images.size());
  context.pool->ParallelFor(images.size(), [&](size_t i) {
    const std::vector<ImageId> around = CovisibleImages(map, images[i], options.images_max, known);
    visible[i] = JudgeAround(map, map.image(images[i]), around, options);
  });
  for (size_t i = 0; i < images.size(); ++i) (*judged)[images[i]] = visible[i];
}

// The image that is contradicted most.
std::optional<ImageId> FindWorst(const Judgements& judged, const DoubtOptions& options) {
  std::optional<ImageId> worst;
  for (const auto& [id, visible] : judged) {
    if (!IsContradicted(visible, options)) continue;
    if (!worst || visible.missing_share() > judged.at(*worst).missing_share()) worst = id;
  }
  return worst;
}

// Takes poses until no image is contradicted. `members` are the images that are left.
void UnplaceContradicted(const MappingContext& context, std::span<const ImageId> known,
                         std::set<ImageId>* members, Healing* healing) {
  Judgements judged;
  Judge(context, std::vector(members->begin(), members->end()), known, &judged);
  while (const std::optional<ImageId> worst = FindWorst(judged, context.options.doubt)) {
    healing->unplaced.push_back({*worst, MissingText(judged.at(*worst))});
    std::vector<ImageId> around = CovisibleImages(*context.map, *worst, known.size(), known);
    context.map->UnplaceImage(*worst);
    members->erase(*worst);
    judged.erase(*worst);
    std::erase_if(around, [&](ImageId id) { return !members->contains(id); });
    Judge(context, around, known, &judged);
  }
}

using EvidenceOfPairs = std::map<std::pair<ImageId, ImageId>, PairEvidence>;

// How many points the image shares with each member of a higher id.
std::vector<PairEvidence> CountShared(const CityMap& map, const std::set<ImageId>& members,
                                      ImageId id) {
  std::unordered_map<ImageId, uint32_t> shared;
  for (const PointId point : map.PointsSeenBy({&id, 1})) {
    for (const TrackElement& element : map.point(point).track) {
      if (id < element.image && members.contains(element.image)) ++shared[element.image];
    }
  }
  std::vector<PairEvidence> evidence;
  for (const auto& [other, count] : shared) {
    evidence.push_back({.a = id, .b = other, .shared_points = count});
  }
  return evidence;
}

// The images whose cameras stand nearest and look the same way.
std::vector<ImageId> FindBeside(const CityMap& map, ImageId image, const std::set<ImageId>& members,
                                const DoubtOptions& options) {
  const Rigid3& pose = map.image(image).cam_from_world;
  const double cosine_min = std::cos(options.beside_angle_deg_max * kRadPerDeg);
  std::vector<std::pair<double, ImageId>> ranked;
  for (const ImageId id : members) {
    if (id == image) continue;
    const Rigid3& other = map.image(id).cam_from_world;
    const double cosine = (pose.rotation * other.rotation.conjugate()).toRotationMatrix()(2, 2);
    if (cosine < cosine_min) continue;
    ranked.emplace_back((pose.Center() - other.Center()).squaredNorm(), id);
  }
  const size_t count = std::min<size_t>(ranked.size(), options.images_max);
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<ptrdiff_t>(count), ranked.end());
  std::vector<ImageId> beside;
  for (size_t i = 0; i < count; ++i) beside.push_back(ranked[i].second);
  return beside;
}

// Images that stand side by side and look the same way, share hardly a point, and lack most of what
// the other sees: two places that were taken for one. What is missing counts as contradicting.
void AddMissing(const MappingContext& context, const std::vector<ImageId>& members,
                EvidenceOfPairs* evidence) {
  const CityMap& map = *context.map;
  const DoubtOptions& options = context.options.doubt;
  const std::set<ImageId> all(members.begin(), members.end());
  std::vector<std::vector<std::pair<ImageId, uint32_t>>> missing(members.size());
  context.pool->ParallelFor(members.size(), [&](size_t i) {
    const ImageId id = members[i];
    for (const ImageId other : FindBeside(map, id, all, options)) {
      const auto known = evidence->find(std::minmax(id, other));
      if (known != evidence->end() &&
          known->second.shared_points >= options.parts.shared_points_min)
        continue;
      const MapImage& image = map.image(id);
      const VisibleStructure visible =
          FindSurelyVisible(map, image, ListSeenDepths(map, image), map.PointsSeenBy({&other, 1}),
                            options.visibility);
      if (visible.missing_cells >= options.missing_cells_min &&
          visible.missing_share() > options.beside_missing_share_max)
        missing[i].emplace_back(other, visible.expected - visible.found);
    }
  });
  for (size_t i = 0; i < members.size(); ++i) {
    for (const auto& [other, count] : missing[i]) {
      const auto [a, b] = std::minmax(members[i], other);
      PairEvidence& pair = (*evidence)[{a, b}];
      pair.a = a, pair.b = b;
      pair.contradicting_matches += std::min(count, options.pair_weight_max);
    }
  }
}

// What the image's verified pairs with members of higher ids say.
Status AddStoredPairs(const MappingContext& context, const std::set<ImageId>& members,
                      const std::set<ImageId>& uncertain, ImageId id,
                      std::vector<PairEvidence>* evidence) {
  const CityMap& map = *context.map;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          context.loader->snapshot().ListNeighbors(id));
  for (const PairNeighbor& neighbor : neighbors) {
    if (neighbor.image <= id || !members.contains(neighbor.image) ||
        neighbor.geometry == PairGeometry::kRotation)
      continue;
    VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored, context.loader->GetPair(id, neighbor.image));
    const PairMatches matches = MatchesFrom(stored, id);
    const MapImage &image = map.image(id), &other = map.image(neighbor.image);
    const uint32_t weight = std::min(static_cast<uint32_t>(stored.matches.size()),
                                     context.options.doubt.pair_weight_max);
    PairEvidence& pair = evidence->emplace_back(PairEvidence{.a = id, .b = neighbor.image});
    if (!ExplainsPair(map, image, other, matches, context.options.agreement)) {
      pair.contradicting_matches = weight;
      continue;
    }
    pair.agreeing_matches = weight;
    const bool is_uncertain = uncertain.contains(id) || uncertain.contains(neighbor.image);
    if (IsTurned(image, other, matches,
                 is_uncertain ? OfUncertainLenses(context.options.agreement)
                              : context.options.agreement))
      pair.turned_matches = weight;
  }
  return Status::Ok();
}

Result<std::vector<PairEvidence>> GatherEvidence(const MappingContext& context,
                                                 const std::set<ImageId>& members) {
  const std::vector<ImageId> images(members.begin(), members.end());
  VEDUTA_ASSIGN_OR_RETURN(const std::set<ImageId> uncertain,
                          ListUncertainLenses(context.loader->snapshot(), members));
  std::vector<std::vector<PairEvidence>> found(images.size());
  std::vector<Status> statuses(images.size());
  context.pool->ParallelFor(images.size(), [&](size_t i) {
    found[i] = CountShared(*context.map, members, images[i]);
    statuses[i] = AddStoredPairs(context, members, uncertain, images[i], &found[i]);
  });
  EvidenceOfPairs evidence;
  for (size_t i = 0; i < images.size(); ++i) {
    VEDUTA_RETURN_IF_ERROR(statuses[i]);
    for (const PairEvidence& part : found[i]) {
      PairEvidence& pair = evidence[{part.a, part.b}];
      pair.a = part.a, pair.b = part.b;
      pair.shared_points += part.shared_points;
      pair.agreeing_matches += part.agreeing_matches;
      pair.contradicting_matches += part.contradicting_matches;
      pair.turned_matches += part.turned_matches;
    }
  }
  AddMissing(context, images, &evidence);
  std::vector<PairEvidence> all;
  for (const auto& [ids, pair] : evidence) all.push_back(pair);
  return all;
}

// A reconstruction is of three images at least.
constexpr size_t kImagesMin = 3;
constexpr const char* kTooFewLeft = "less than three images are left there that agree";

// The parts that agree. Rotations of pairs may part large ones; an image or two that they alone
// speak against stay where they are.
std::vector<std::vector<ImageId>> FindParts(std::span<const ImageId> images,
                                            std::span<const PairEvidence> evidence,
                                            AgreementBounds bounds) {
  std::vector<std::vector<ImageId>> parts = FindAgreeingParts(images, evidence, bounds);
  bounds.counts_turned = false;
  const std::vector<std::vector<ImageId>> whole = FindAgreeingParts(images, evidence, bounds);
  if (parts.front().size() < kImagesMin) return parts;
  const std::vector<ImageId> largest = parts.front();
  const auto holds = [](const std::vector<ImageId>& part, ImageId id) {
    return std::ranges::binary_search(part, id);
  };
  const std::vector<ImageId>& around = *std::ranges::find_if(
      whole, [&](const std::vector<ImageId>& part) { return holds(part, largest.front()); });
  std::vector<ImageId> back;
  std::erase_if(parts, [&](const std::vector<ImageId>& part) {
    if (part.size() >= kImagesMin || !holds(around, part.front())) return false;
    back.insert(back.end(), part.begin(), part.end());
    return true;
  });
  parts.front().insert(parts.front().end(), back.begin(), back.end());
  std::ranges::sort(parts.front());
  return parts;
}

// Whether the pictures on both sides of the border of a part show all that they must see of the
// other side, so that more of the pairs across may contradict: lookalike facades do that, too.
bool IsConfirmedWhereItIs(const MappingContext& context, std::span<const ImageId> part,
                          std::span<const PairEvidence> evidence) {
  const CityMap& map = *context.map;
  const DoubtOptions& options = context.options.doubt;
  std::set<ImageId> sides[2];
  uint64_t agreeing = 0, contradicting = 0;
  for (const PairEvidence& pair : evidence) {
    const bool a_is_in = std::ranges::binary_search(part, pair.a);
    if (a_is_in == std::ranges::binary_search(part, pair.b)) continue;
    agreeing += pair.agreeing_matches;
    contradicting += pair.contradicting_matches;
    if (pair.shared_points < options.parts.shared_points_min && pair.agreeing_matches == 0)
      continue;
    sides[a_is_in].insert(pair.a), sides[!a_is_in].insert(pair.b);
  }
  if (static_cast<double>(contradicting) >
      options.seam_confirmed_contradiction_share_max * static_cast<double>(agreeing))
    return false;
  VisibleStructure sum;
  for (const bool is_part : {false, true}) {
    const std::vector<ImageId> views(sides[is_part].begin(), sides[is_part].end());
    const std::vector<ImageId> others(sides[!is_part].begin(), sides[!is_part].end());
    const std::vector<PointId> points = map.PointsSeenBy(others);
    std::vector<VisibleStructure> visible(views.size());
    context.pool->ParallelFor(views.size(), [&](size_t i) {
      const MapImage& view = map.image(views[i]);
      visible[i] =
          FindVisible(map, view, ListSeenDepths(map, view), points, options.seam_visibility);
    });
    for (const VisibleStructure& one : visible) {
      sum.cells += one.cells;
      sum.missing_cells += one.missing_cells;
    }
  }
  return IsConfirmed(sum, options);
}

void Unplace(CityMap* map, const std::set<ImageId>& images, const std::string& why,
             Healing* healing) {
  for (const ImageId id : images) {
    map->UnplaceImage(id);
    healing->unplaced.push_back({id, why});
  }
}

}  // namespace

Status DoubtOptions::Check() const {
  return OptionBounds()
      .Part("visibility", visibility.Check())
      .Part("seam_visibility", seam_visibility.Check())
      .AtLeast("images_max", images_max, 1)
      .Inside("beside_angle_deg_max", beside_angle_deg_max, 0, 90)
      .AtLeast("missing_cells_min", missing_cells_min, 1)
      .AboveUpTo("missing_share_max", missing_share_max, 0, 1)
      .AtLeast("better_cells_min", better_cells_min, 1)
      .AtLeast("better_missing_cells_min", better_missing_cells_min, 1)
      .Between("better_missing_share_max", better_missing_share_max, 0, 1)
      .AtLeast("either_side_points_min", either_side_points_min, 1)
      .AboveUpTo("either_side_share_min", either_side_share_min, 0, 1)
      .AtLeast("either_side_matches_min", either_side_matches_min, 1)
      .AtLeast("outweighing_factor", outweighing_factor, 1)
      .AtLeast("mixed_missing_cells_min", mixed_missing_cells_min, 1)
      .Between("mixed_missing_share_max", mixed_missing_share_max, 0, 1)
      .AtLeast("mixed_pairs_min", mixed_pairs_min, 1)
      .Between("mixed_within_share_max", mixed_within_share_max, 0, 1)
      .Above("mixed_agreeing_share_max", mixed_agreeing_share_max, 0)
      .AtLeast("seam_mixed_pairs_min", seam_mixed_pairs_min, 1)
      .Between("seam_mixed_share_max", seam_mixed_share_max, 0, 1)
      .Between("body_mixed_share_max", body_mixed_share_max, 0, 1)
      .AtLeast("seam_pairs_min", seam_pairs_min, 1)
      .Above("seam_jackknife_share_max", seam_jackknife_share_max, 0)
      .AtLeast("pair_weight_max", pair_weight_max, 1)
      .Above("seam_contradiction_share_max", seam_contradiction_share_max, 0)
      .Above("seam_confirmed_contradiction_share_max", seam_confirmed_contradiction_share_max, 0)
      .AtLeast("seam_confirmed_cells_min", seam_confirmed_cells_min, 1)
      .Between("seam_confirmed_missing_share_max", seam_confirmed_missing_share_max, 0, 1)
      .AboveUpTo("seam_missing_share_max", seam_missing_share_max, 0, 1)
      .AtLeast("seam_view_missing_cells_min", seam_view_missing_cells_min, 1)
      .AboveUpTo("seam_view_missing_share_max", seam_view_missing_share_max, 0, 1)
      .AboveUpTo("beside_missing_share_max", beside_missing_share_max, 0, 1)
      .AtLeast("images_between_min", images_between_min, 1)
      .Above("raising_contradiction_share_min", raising_contradiction_share_min, 0)
      .Part("parts", parts.Check())
      .status();
}

VisibleStructure FindAround(const CityMap& map, const MapImage& view,
                            std::span<const ImageId> around, const DoubtOptions& options) {
  return FindVisible(map, view, ListSeenDepths(map, view), map.PointsSeenBy(around),
                     options.visibility);
}

VisibleStructure JudgeAround(const CityMap& map, const MapImage& view,
                             std::span<const ImageId> around, const DoubtOptions& options) {
  const VisibleStructure visible = FindAround(map, view, around, options);
  if (!IsContradicted(visible, options)) return visible;
  const std::vector<SeenDepth> seen = ListSeenDepths(map, view);
  const std::vector<PointId> points = map.PointsSeenBy(around);
  const VisibleStructure surely = FindSurelyVisible(map, view, seen, points, options.visibility);
  if (FitsWell(surely, options)) return surely;
  const VisibleStructure usually =
      FindUsuallySeen(map, view, seen, points, around, options.visibility);
  return IsContradicted(usually, options) ? visible : usually;
}

bool IsContradicted(const VisibleStructure& visible, const DoubtOptions& options) {
  return visible.missing_cells >= options.missing_cells_min &&
         visible.missing_share() > options.missing_share_max;
}

bool IsConfirmed(const VisibleStructure& across, const DoubtOptions& options) {
  return across.cells >= options.seam_confirmed_cells_min &&
         across.missing_share() <= options.seam_confirmed_missing_share_max;
}

bool FitsWell(const VisibleStructure& there, const DoubtOptions& options) {
  return there.cells >= options.better_cells_min &&
         there.missing_share() <= options.better_missing_share_max;
}

bool IsClearlyBetter(const VisibleStructure& there, const VisibleStructure& here,
                     const DoubtOptions& options) {
  return FitsWell(there, options) && here.missing_cells >= options.better_missing_cells_min &&
         here.missing_share() > there.missing_share() + options.better_missing_share_max;
}

bool IsOfAnotherPlace(const VisibleStructure& of_one, const DoubtOptions& options) {
  return of_one.missing_cells >= options.mixed_missing_cells_min &&
         of_one.missing_share() > options.mixed_missing_share_max;
}

std::string MissingText(const VisibleStructure& visible) {
  return std::to_string(visible.missing_cells) + " of " + std::to_string(visible.cells) +
         " parts of the picture lack what other photos see there";
}

Result<Healing> HealRegion(const MappingContext& context, std::span<const ImageId> images,
                           std::span<const ImageId> known) {
  Healing healing;
  VEDUTA_ASSIGN_OR_RETURN(healing.evidence,
                          GatherEvidence(context, std::set(known.begin(), known.end())));
  // What stays: all but the parts that are cut off.
  std::set<ImageId> staying(images.begin(), images.end());
  std::vector<std::set<ImageId>> parts;
  healing.agreeing = FindParts(known, healing.evidence, context.options.doubt.parts);
  const std::vector<std::vector<ImageId>>& found = healing.agreeing;
  for (size_t i = 0; i < found.size(); ++i) {
    // Of a part that reaches out of the region nobody here knows what else holds it.
    const bool is_inside = std::ranges::all_of(
        found[i], [&](ImageId id) { return std::ranges::binary_search(images, id); });
    const bool is_first = i == 0 && found[i].size() >= kImagesMin;
    if (is_first || !is_inside) continue;
    if (found[i].size() >= kImagesMin && IsConfirmedWhereItIs(context, found[i], healing.evidence))
      continue;
    for (const ImageId id : found[i]) staying.erase(id);
    const std::set<ImageId> part(found[i].begin(), found[i].end());
    if (part.size() >= kImagesMin) {
      parts.push_back(part);
    } else {
      Unplace(context.map, part, "what is known of it contradicts where it was", &healing);
    }
  }
  for (const std::set<ImageId>& part : parts) context.map->CutOff(part);
  const bool is_whole = images.size() == known.size();
  UnplaceContradicted(context, known, &staying, &healing);
  if (is_whole && staying.size() < kImagesMin) Unplace(context.map, staying, kTooFewLeft, &healing);
  for (std::set<ImageId>& part : parts) {
    UnplaceContradicted(context, known, &part, &healing);
    if (part.size() < kImagesMin) {
      Unplace(context.map, part, kTooFewLeft, &healing);
    } else {
      healing.parts.emplace_back(part.begin(), part.end());
    }
  }
  return healing;
}

}  // namespace veduta
