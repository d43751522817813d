// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which pose of a photo is believed: how poses are sought, how one is chosen and entered into the
// map, and for what reasons it is refused. Adding a photo and localising one share all of it.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/ingest/mapping_context.h"
#include "engine/ingest/placement.h"
#include "engine/ingest/pose_search.h"

namespace veduta {

// The pairs without those of photos that must not have a pose: they found nothing, and a photo
// whose matches lead to them need not wait for them.
Result<std::vector<PairMatches>> WithoutForbidden(const Snapshot& snapshot,
                                                  std::span<const PairMatches> pairs);

// Loads those of the pairs' images that have a pose, with their neighbourhood.
Status LoadNeighbors(const MappingContext& context, std::span<const PairMatches> pairs);

// Where the neighbours of a photo say that it was taken.
struct SoughtPoses {
  std::vector<PairMatches> putative;  // of MatchPlacedNeighbors
  PoseSearch search;

  bool has_sure_pose() const { return !search.found.empty() && !search.found.front().is_weak; }
};

// Loads the neighbours with their neighbourhood, and seeks the photo's poses by them.
// Deterministic in its inputs and the seed.
Result<SoughtPoses> SeekPoses(const MappingContext& context, const ImageFeatures& photo,
                              std::span<const PairMatches> pairs, uint64_t seed);

// The first pose that is good enough, unless one in another reconstruction is clearly better: of
// twin facades the wrong one may give more points. Null where none is good enough; otherwise one of
// `found`.
Result<const PoseCandidate*> ChoosePose(const MappingContext& context, const ImageFeatures& photo,
                                        const std::vector<PoseCandidate>& found);

Placement Postponed(Reason reason, std::string detail);
// The photo placed at that pose, and in words by what.
Placement PlacedAt(const ImageFeatures& photo, const PoseCandidate& pose);

// Puts the photo into the map at that pose, with the tracks that its putative matches give. Returns
// the photo postponed where what it sees does not say where it stands, or where its picture lacks
// what others see there; it is in the map then, too.
Result<std::optional<Placement>> EnterPose(const MappingContext& context,
                                           const ImageFeatures& photo, const PoseCandidate& pose,
                                           std::span<const PairMatches> putative);

// The photo postponed, where the picture of a placed photo lacks what others see there.
Result<std::optional<Placement>> AskWhatIsMissing(const MappingContext& context, ImageId photo);
// The photo postponed, where adjustment has left a placed photo too few points.
std::optional<Placement> AskHowMuchItSees(const MappingContext& context, ImageId photo);

}  // namespace veduta
