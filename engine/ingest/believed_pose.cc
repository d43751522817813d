// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/believed_pose.h"

#include <cmath>
#include <cstdio>
#include <utility>

#include "engine/ingest/doubt.h"
#include "engine/ingest/local_unplacing.h"
#include "engine/ingest/misplaced.h"
#include "engine/mapping/agreeing_growth.h"
#include "engine/mapping/covisible_images.h"
#include "engine/mapping/pose_deviation.h"
#include "engine/query/forbidden.h"

namespace veduta {
namespace {

// What the photo would lack at that pose.
Result<VisibleStructure> JudgeCandidate(const MappingContext& context, const ImageFeatures& photo,
                                        const PoseCandidate& candidate) {
  MapImage view = UnplacedImage(photo);
  view.reconstruction = candidate.reconstruction;
  view.cam_from_world = candidate.resection.cam_from_world;
  for (const auto& [feature, point] : candidate.seen) view.points[feature] = point;
  return JudgeView(context, view);
}

// The photo postponed, where what it sees does not say where it stands.
std::optional<Placement> AskWhetherDetermined(const MappingContext& context, ImageId photo) {
  const double share = DeviationShare(*context.map, photo);
  if (share <= context.options.deviation_share_max) return std::nullopt;
  const ReconstructionId reconstruction = context.map->image(photo).reconstruction;
  if (!std::isfinite(share)) {
    return Postponed(Reason::kUndetermined, "what it sees of reconstruction " +
                                                std::to_string(reconstruction.value) +
                                                " fits any place");
  }
  char text[160];
  std::snprintf(
      text, sizeof(text),
      "by what it sees of reconstruction %u, errors of 1 mrad move it by %.2g %% of how far "
      "it sees",
      reconstruction.value, 100 * share);
  return Postponed(Reason::kUndetermined, text);
}

}  // namespace

Result<std::vector<PairMatches>> WithoutForbidden(const Snapshot& snapshot,
                                                  std::span<const PairMatches> pairs) {
  std::vector<PairMatches> allowed;
  for (const PairMatches& pair : pairs) {
    VEDUTA_ASSIGN_OR_RETURN(const bool is_forbidden, IsPoseForbidden(snapshot, pair.other));
    if (!is_forbidden) allowed.push_back(pair);
  }
  return allowed;
}

Status LoadNeighbors(const MappingContext& context, std::span<const PairMatches> pairs) {
  std::vector<ImageId> neighbors;
  for (const PairMatches& pair : pairs) neighbors.push_back(pair.other);
  return context.loader->LoadNeighborhood(neighbors);
}

Result<SoughtPoses> SeekPoses(const MappingContext& context, const ImageFeatures& photo,
                              std::span<const PairMatches> pairs, uint64_t seed) {
  VEDUTA_RETURN_IF_ERROR(LoadNeighbors(context, pairs));
  SoughtPoses sought;
  VEDUTA_ASSIGN_OR_RETURN(sought.putative, MatchPlacedNeighbors(context, photo, pairs));
  sought.search = FindPoses(*context.map, photo, pairs, sought.putative, seed, context.options);
  return sought;
}

Result<const PoseCandidate*> ChoosePose(const MappingContext& context, const ImageFeatures& photo,
                                        const std::vector<PoseCandidate>& found) {
  std::vector<const PoseCandidate*> good;
  for (const PoseCandidate& candidate : found) {
    if (IsGoodEnough(candidate, context.options)) good.push_back(&candidate);
  }
  if (good.size() < 2) return good.empty() ? nullptr : good.front();
  const PoseCandidate* best = good.front();
  VEDUTA_ASSIGN_OR_RETURN(VisibleStructure visible, JudgeCandidate(context, photo, *best));
  for (size_t i = 1; i < good.size(); ++i) {
    VEDUTA_ASSIGN_OR_RETURN(const VisibleStructure other, JudgeCandidate(context, photo, *good[i]));
    if (!IsClearlyBetter(other, visible, context.options.doubt)) continue;
    best = good[i];
    visible = other;
  }
  return best;
}

Placement Postponed(Reason reason, std::string detail) {
  Placement postponed;
  postponed.reason = reason;
  postponed.detail = std::move(detail);
  return postponed;
}

Placement PlacedAt(const ImageFeatures& photo, const PoseCandidate& pose) {
  Placement placement;
  placement.verdict = Verdict::kPlaced;
  placement.reason = Reason::kRegistered;
  placement.reconstruction = pose.reconstruction;
  placement.placed = {photo.id};
  placement.inlier_count = static_cast<uint32_t>(pose.resection.inliers.size());
  placement.detail = "agrees with " + std::to_string(placement.inlier_count) + " of " +
                     std::to_string(pose.point_count) + " points";
  if (pose.along.valid()) {
    placement.detail += ", along the baseline to image " + std::to_string(pose.along.value);
  }
  return placement;
}

Result<std::optional<Placement>> EnterPose(const MappingContext& context,
                                           const ImageFeatures& photo, const PoseCandidate& pose,
                                           std::span<const PairMatches> putative) {
  MapImage image = UnplacedImage(photo);
  image.reconstruction = pose.reconstruction;
  image.cam_from_world = pose.resection.cam_from_world;
  context.map->PlaceImage(std::move(image));
  GrowAndRefine(context.map, photo.id, putative, context.options.growth);
  if (std::optional<Placement> postponed = AskWhetherDetermined(context, photo.id))
    return postponed;
  return AskWhatIsMissing(context, photo.id);
}

Result<std::optional<Placement>> AskWhatIsMissing(const MappingContext& context, ImageId photo) {
  const MapImage& image = context.map->image(photo);
  const DoubtOptions& options = context.options.doubt;
  const std::vector<ImageId> around = CovisibleImages(*context.map, image, options.images_max);
  VEDUTA_RETURN_IF_ERROR(context.loader->LoadNeighborhood(around));
  const VisibleStructure visible = JudgeAround(*context.map, image, around, options);
  if (!IsContradicted(visible, options)) return std::optional<Placement>();
  return std::optional(
      Postponed(Reason::kMissingStructure, "of the pose in reconstruction " +
                                               std::to_string(image.reconstruction.value) + ", " +
                                               MissingText(visible)));
}

std::optional<Placement> AskHowMuchItSees(const MappingContext& context, ImageId photo) {
  const uint32_t seen = CountObservations(context.map->image(photo));
  if (seen >= context.options.observations_min) return std::nullopt;
  return Postponed(Reason::kResectionFailed,
                   "only " + std::to_string(seen) + " points are left after adjustment; " +
                       std::to_string(context.options.observations_min) + " are needed");
}

}  // namespace veduta
