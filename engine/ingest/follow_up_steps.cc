// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/follow_up_steps.h"

#include <algorithm>

#include "engine/ingest/change_writer.h"
#include "engine/ingest/photo_placement.h"
#include "engine/ingest/placement_writer.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "engine/journal/journal.h"
#include "storage/base/content_hash.h"
#include "storage/written_ahead.h"

namespace veduta {
namespace {

// The image's verified pairs, as they are stored.
Result<std::vector<PairMatches>> StoredMatches(const MapLoader& loader, ImageId image) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          loader.snapshot().ListNeighbors(image));
  std::vector<PairMatches> pairs;
  for (const PairNeighbor& neighbor : neighbors) {
    VEDUTA_ASSIGN_OR_RETURN(const PairRecord pair, loader.GetPair(image, neighbor.image));
    pairs.push_back(MatchesFrom(pair, image));
  }
  return pairs;
}

// Places the photo by as many features as when it came and was not placed.
Result<Placement> PlaceAgain(const IngestParts& parts, const std::shared_ptr<const Snapshot>& base,
                             const ImageRecord& record, ReconstructionId new_reconstruction) {
  VEDUTA_ASSIGN_OR_RETURN(const auto known, parts.features->Get(*base, record.id));
  VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, base->GetCamera(record.camera));
  VEDUTA_ASSIGN_OR_RETURN(const auto features,
                          ImageFeatures::Make(record.id, camera.model, known->features,
                                              parts.options.thorough_count_max));
  MapLoader loader(base, parts.features, parts.map);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs, StoredMatches(loader, record.id));
  return PlacePhoto({&loader, parts.map, parts.pool, parts.options.mapper}, *features, pairs,
                    new_reconstruction, MixSeed(record.photo.Seed(), 1));
}

void JournalRetry(ImageId image, const Placement& placement, DatabaseState* state,
                  Transaction* transaction) {
  JournalRecord entry;
  entry.actor = "veduta";
  entry.action = "propagate";
  entry.image = image;
  entry.reconstruction = placement.reconstruction;
  entry.detail = placement.detail;
  AppendJournal(std::move(entry), state, transaction);
}

}  // namespace

Result<std::vector<ImageId>> RetryPhoto(const IngestParts& parts, ImageId image, WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  std::erase(state.pending_propagation, image);
  parts.TrimMap();
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, scope.base->FindPose(image));
  Placement placement;
  if (!pose) {
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord record, scope.base->GetImage(image));
    VEDUTA_ASSIGN_OR_RETURN(placement, PlaceAgain(parts, scope.base, record,
                                                  ReconstructionId(state.next_reconstruction)));
    record.reason =
        placement.reason == Reason::kRegistered ? Reason::kPropagated : placement.reason;
    record.verdict = placement.verdict;
    record.detail = placement.detail;
    scope.transaction->PutImage(record);
    VEDUTA_RETURN_IF_ERROR(
        WritePlacement(*parts.map, *scope.base, placement, &state, scope.transaction.get()));
    if (!placement.placed.empty()) JournalRetry(image, placement, &state, scope.transaction.get());
  }
  scope.transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  parts.map->ClearChanges();
  return placement.placed;
}

Status AdjustWhole(const IngestParts& parts, ReconstructionId reconstruction, WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord before,
                          scope.base->GetReconstruction(reconstruction));
  MapLoader loader(scope.base, parts.features, parts.map);
  VEDUTA_RETURN_IF_ERROR(
      AdjustReconstruction({&loader, parts.map, parts.pool, parts.options.mapper}, reconstruction));
  const WrittenAhead blocks =
      WrittenAhead::PointBlocks(parts.database, reconstruction, before.points_generation + 1);
  VEDUTA_ASSIGN_OR_RETURN(
      const ReconstructionRecord after,
      WriteAdjustment(*parts.map, before, parts.database, scope.transaction.get()));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  JournalRecord entry;
  entry.actor = "veduta";
  entry.action = "adjust";
  entry.reconstruction = after.id;
  entry.detail = std::to_string(after.image_count) + " images";
  AppendJournal(std::move(entry), &state, scope.transaction.get());
  scope.transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  parts.map->ClearChanges();
  return Status::Ok();
}

}  // namespace veduta
