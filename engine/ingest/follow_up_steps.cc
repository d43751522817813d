// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/follow_up_steps.h"

#include <algorithm>

#include "engine/ingest/change_writer.h"
#include "engine/ingest/due_work.h"
#include "engine/ingest/healing_writer.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/lens_refinement.h"
#include "engine/ingest/photo_placement.h"
#include "engine/ingest/placement_writer.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "engine/ingest/submap_borders.h"
#include "engine/ingest/submaps.h"
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

// Tries to place a stored photo by as many features as the second search of a new photo uses.
Result<Placement> PlaceAgain(const IngestParts& parts, const std::shared_ptr<const Snapshot>& base,
                             const ImageRecord& record, ReconstructionId new_reconstruction) {
  VEDUTA_ASSIGN_OR_RETURN(const auto known, parts.features->Get(*base, record.id));
  VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, base->GetCamera(record.camera));
  VEDUTA_ASSIGN_OR_RETURN(
      const auto features,
      ImageFeatures::Make(record.id, camera.model, known->features,
                          parts.options.thorough_count_max, ImageFeatures::Packing::kKept));
  MapLoader loader(base, parts.features, parts.map, parts.pool);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs, StoredMatches(loader, record.id));
  return PlacePhoto({&loader, parts.map, parts.pool, parts.options.mapper, parts.repetitions},
                    *features, pairs, new_reconstruction, MixSeed(record.photo.Seed(), 1));
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
        WritePlacement(*parts.map, *scope.base, placement, {}, &state, scope.transaction.get()));
    if (!placement.placed.empty()) {
      AppendJournal(
          {0, 0, "veduta", "propagate", image, placement.reconstruction, placement.detail}, &state,
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
  MapLoader loader(scope.base, parts.features, parts.map, parts.pool);
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          scope.base->GetReconstruction(reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(
      const Healing healing,
      AdjustReconstruction({&loader, parts.map, parts.pool, parts.options.mapper}, reconstruction,
                           IsRefinementDue(record) ? Lenses::kRefined : Lenses::kHeld));
  return WriteAdjustedWhole(parts, reconstruction, healing, std::move(scope));
}

Result<AdjustedWhole> WriteAdjustedWhole(const IngestParts& parts, ReconstructionId reconstruction,
                                         const Healing& healing, WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord record,
                          scope.base->GetReconstruction(reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(*scope.base));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(
      const std::vector<ImageId> refined,
      WriteLenses(*scope.base, reconstruction, healing.lenses, &state, transaction));
  HealingWriter writer(parts, scope, reconstruction, &state);
  VEDUTA_RETURN_IF_ERROR(writer.SplitOff(healing));
  transaction->DeletePointBlocks(reconstruction, record.points_generation);
  ++record.points_generation;
  const WrittenAhead blocks =
      WrittenAhead::PointBlocks(parts.database, reconstruction, record.points_generation);
  VEDUTA_RETURN_IF_ERROR(WriteWhole(*parts.map, parts.database, transaction, &record));
  WriteUnplaced(*parts.map, transaction);
  VEDUTA_RETURN_IF_ERROR(writer.RemoveOutdatedDense(healing, refined));
  WritePosesAndObservations(*parts.map, transaction);
  VEDUTA_RETURN_IF_ERROR(submaps.Follow(*parts.map, *scope.base));
  submaps.NoteAdjusted(reconstruction);
  submaps.Write(transaction);
  if (KeepsBorders(record, submaps.IsParted(reconstruction), parts.options.schedule)) {
    MapLoader loader(scope.base, parts.features, parts.map, parts.pool);
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<SubmapBorder> borders,
                            FindBorders({&loader, parts.map, parts.pool, parts.options.mapper},
                                        submaps, reconstruction, healing));
    for (const SubmapBorder& border : borders) transaction->PutSubmapBorder(border);
  }
  VEDUTA_RETURN_IF_ERROR(writer.Postpone(healing));
  if (!healing.parts.empty()) {
    VEDUTA_RETURN_IF_ERROR(writer.ShareSeams(healing));
  } else {
    VEDUTA_RETURN_IF_ERROR(
        record.is_dissolved
            ? DropHypotheses(*scope.base, reconstruction, transaction)
            : MakeHypothesesDue(*scope.base, reconstruction, {}, Splits::kMeant, transaction));
  }
  VEDUTA_RETURN_IF_ERROR(writer.ProposeSeams());
  const std::string detail = std::to_string(record.image_count) + " images";
  AppendJournal({0, 0, "veduta", "adjust", {}, reconstruction, detail}, &state, transaction);
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  // Refined focal lengths in it may differ from those stored by rounding.
  if (!refined.empty()) parts.map->Clear();
  return writer.adjusted();
}

}  // namespace veduta
