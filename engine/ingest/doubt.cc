// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/doubt.h"

#include <algorithm>
#include <map>
#include <optional>

#include "engine/ingest/surroundings.h"
#include "engine/mapping/neighbor_agreement.h"

namespace veduta {
namespace {

using Judgements = std::map<ImageId, VisibleStructure>;

// Judges these images anew, side by side.
void Judge(const MappingContext& context, std::span<const ImageId> images, Judgements* judged) {
  const CityMap& map = *context.map;
  const DoubtOptions& options = context.options.doubt;
  std::vector<VisibleStructure> visible(images.size());
  context.pool->ParallelFor(images.size(), [&](size_t i) {
    const std::vector<ImageId> around = CovisibleImages(map, images[i], options.images_max);
    visible[i] = FindAround(map, map.image(images[i]), around, options);
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
void UnplaceContradicted(const MappingContext& context, std::set<ImageId>* members,
                         Healing* healing) {
  Judgements judged;
  Judge(context, std::vector(members->begin(), members->end()), &judged);
  while (const std::optional<ImageId> worst = FindWorst(judged, context.options.doubt)) {
    healing->unplaced.push_back({*worst, MissingText(judged.at(*worst))});
    const std::vector<ImageId> around = CovisibleImages(*context.map, *worst, members->size());
    context.map->UnplaceImage(*worst);
    members->erase(*worst);
    judged.erase(*worst);
    Judge(context, around, &judged);
  }
}

// How many points each two images share.
std::map<std::pair<ImageId, ImageId>, PairEvidence> CountShared(const CityMap& map,
                                                                std::span<const ImageId> images) {
  std::map<std::pair<ImageId, ImageId>, PairEvidence> evidence;
  for (const PointId id : map.PointsSeenBy(images)) {
    const std::vector<TrackElement>& track = map.point(id).track;
    for (size_t i = 0; i < track.size(); ++i) {
      for (size_t j = i + 1; j < track.size(); ++j) {
        PairEvidence& pair = evidence[{track[i].image, track[j].image}];
        pair.a = track[i].image, pair.b = track[j].image;
        ++pair.shared_points;
      }
    }
  }
  return evidence;
}

Result<std::vector<PairEvidence>> GatherEvidence(const MappingContext& context,
                                                 const std::set<ImageId>& members) {
  const CityMap& map = *context.map;
  auto evidence = CountShared(map, std::vector(members.begin(), members.end()));
  for (const ImageId id : members) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                            context.loader->snapshot().ListNeighbors(id));
    for (const PairNeighbor& neighbor : neighbors) {
      if (neighbor.image <= id || !members.contains(neighbor.image) ||
          neighbor.geometry == PairGeometry::kRotation)
        continue;
      VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored, context.loader->GetPair(id, neighbor.image));
      const bool agrees = ExplainsMatches(map, map.image(id), map.image(neighbor.image),
                                          stored.matches, context.options.agreement);
      PairEvidence& pair = evidence[{id, neighbor.image}];
      pair.a = id, pair.b = neighbor.image;
      (agrees ? pair.agreeing_matches : pair.contradicting_matches) +=
          static_cast<uint32_t>(stored.matches.size());
    }
  }
  std::vector<PairEvidence> all;
  for (const auto& [ids, pair] : evidence) all.push_back(pair);
  return all;
}

// A reconstruction is of three images at least.
constexpr size_t kImagesMin = 3;

// Cuts off all parts but the largest. No part of less than three images keeps a pose, the largest
// neither.
Status CutDisagreeing(const MappingContext& context, const std::set<ImageId>& members,
                      Healing* healing) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairEvidence> evidence,
                          GatherEvidence(context, members));
  std::vector<std::vector<ImageId>> parts = FindAgreeingParts(
      std::vector(members.begin(), members.end()), evidence, context.options.doubt.parts);
  for (size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].size() >= kImagesMin) {
      if (i == 0) continue;
      context.map->CutOff(std::set(parts[i].begin(), parts[i].end()));
      healing->parts.push_back(std::move(parts[i]));
      continue;
    }
    for (const ImageId id : parts[i]) {
      context.map->UnplaceImage(id);
      healing->unplaced.push_back({id, i == 0 ? "less than three images are left there that agree"
                                              : "its verified neighbours contradict where it was"});
    }
  }
  return Status::Ok();
}

}  // namespace

VisibleStructure FindAround(const CityMap& map, const MapImage& view,
                            std::span<const ImageId> around, const DoubtOptions& options) {
  return FindVisible(map, view, map.PointsSeenBy(around), options.visibility);
}

bool IsContradicted(const VisibleStructure& visible, const DoubtOptions& options) {
  return visible.missing_cells >= options.missing_cells_min &&
         visible.missing_share() > options.missing_share_max;
}

std::string MissingText(const VisibleStructure& visible) {
  return std::to_string(visible.missing_cells) + " of " + std::to_string(visible.cells) +
         " parts of the picture lack what other photos see there";
}

Result<Healing> HealReconstruction(const MappingContext& context, std::span<const ImageId> images) {
  Healing healing;
  std::set<ImageId> members(images.begin(), images.end());
  UnplaceContradicted(context, &members, &healing);
  VEDUTA_RETURN_IF_ERROR(CutDisagreeing(context, members, &healing));
  return healing;
}

}  // namespace veduta
