// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/follow_up_steps.h"

#include <algorithm>
#include <set>

#include "engine/ingest/change_writer.h"
#include "engine/ingest/dense_removal.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/local_unplacing.h"
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

void Journal(const char* action, ImageId image, ReconstructionId reconstruction, std::string detail,
             DatabaseState* state, Transaction* transaction) {
  JournalRecord entry;
  entry.actor = "veduta";
  entry.action = action;
  entry.image = image;
  entry.reconstruction = reconstruction;
  entry.detail = std::move(detail);
  AppendJournal(std::move(entry), state, transaction);
}

// The images become a reconstruction of their own. Its frame is the one that they had, so the
// similarity between the two is the identity.
Result<ReconstructionId> SplitOff(const IngestParts& parts, std::span<const ImageId> images,
                                  ReconstructionId from, std::vector<WrittenAhead>* blocks,
                                  DatabaseState* state, Transaction* transaction) {
  ReconstructionRecord record;
  record.id = ReconstructionId(state->next_reconstruction++);
  record.points_generation = 1;
  for (const ImageId id : images) {
    parts.map->MoveImage(id, record.id, Sim3());
    parts.map->MoveBlock(id, record.id, Sim3());
  }
  blocks->push_back(WrittenAhead::PointBlocks(parts.database, record.id, 1));
  VEDUTA_RETURN_IF_ERROR(WriteWhole(*parts.map, parts.database, transaction, &record));
  Journal("split", {}, record.id,
          std::to_string(images.size()) + " images of reconstruction " +
              std::to_string(from.value) + ", whose frame it keeps",
          state, transaction);
  return record.id;
}

// The images wait again, and are tried again at once. One that loses its pose for the second time
// since anybody did anything waits for a neighbour: placing and doubting it would never end.
Result<std::vector<LostPose>> PostponeUnplaced(const Snapshot& base, const Healing& healing,
                                               ReconstructionId from, DatabaseState* state,
                                               Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const std::set<ImageId> doubted,
                          AlreadyDoubted(base, state->next_journal));
  std::vector<LostPose> postponed;
  for (const DoubtedImage& unplaced : healing.unplaced) {
    const std::string detail =
        "in reconstruction " + std::to_string(from.value) + ", " + unplaced.why;
    VEDUTA_RETURN_IF_ERROR(
        PostponeImages(base, {&unplaced.image, 1}, from, detail, state, transaction));
    if (doubted.contains(unplaced.image)) std::erase(state->pending_propagation, unplaced.image);
    postponed.push_back({unplaced.image, detail});
  }
  return postponed;
}

// What the dense pass has made of images that are not where they were any more.
Status RemoveOutdatedDense(const Snapshot& base, const Healing& healing, Transaction* transaction) {
  std::vector<ImageId> moved;
  for (const DoubtedImage& unplaced : healing.unplaced) moved.push_back(unplaced.image);
  for (const std::vector<ImageId>& part : healing.parts)
    moved.insert(moved.end(), part.begin(), part.end());
  if (moved.empty()) return Status::Ok();
  return RemoveFromDense(base, moved, transaction).status();
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
    if (!placement.placed.empty()) {
      Journal("propagate", image, placement.reconstruction, placement.detail, &state,
              scope.transaction.get());
    }
  }
  scope.transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(scope.transaction->Commit());
  parts.map->ClearChanges();
  return placement.placed;
}

Result<AdjustedWhole> AdjustWhole(const IngestParts& parts, ReconstructionId reconstruction,
                                  WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord record,
                          scope.base->GetReconstruction(reconstruction));
  MapLoader loader(scope.base, parts.features, parts.map);
  VEDUTA_ASSIGN_OR_RETURN(
      const Healing healing,
      AdjustReconstruction({&loader, parts.map, parts.pool, parts.options.mapper}, reconstruction));
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  std::vector<WrittenAhead> blocks;
  AdjustedWhole adjusted;
  for (const std::vector<ImageId>& part : healing.parts) {
    VEDUTA_ASSIGN_OR_RETURN(adjusted.split_off.emplace_back(),
                            SplitOff(parts, part, reconstruction, &blocks, &state, transaction));
  }
  transaction->DeletePointBlocks(reconstruction, record.points_generation);
  ++record.points_generation;
  blocks.push_back(
      WrittenAhead::PointBlocks(parts.database, reconstruction, record.points_generation));
  VEDUTA_RETURN_IF_ERROR(WriteWhole(*parts.map, parts.database, transaction, &record));
  WriteUnplaced(*parts.map, transaction);
  VEDUTA_RETURN_IF_ERROR(RemoveOutdatedDense(*scope.base, healing, transaction));
  WritePosesAndObservations(*parts.map, transaction);
  VEDUTA_ASSIGN_OR_RETURN(adjusted.unplaced, PostponeUnplaced(*scope.base, healing, reconstruction,
                                                              &state, transaction));
  const bool is_as_it_was = adjusted.split_off.empty() && !record.is_dissolved;
  VEDUTA_RETURN_IF_ERROR(is_as_it_was ? MakeHypothesesDue(*scope.base, reconstruction, transaction)
                                      : DropHypotheses(*scope.base, reconstruction, transaction));
  Journal("adjust", {}, reconstruction, std::to_string(record.image_count) + " images", &state,
          transaction);
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  return adjusted;
}

}  // namespace veduta
