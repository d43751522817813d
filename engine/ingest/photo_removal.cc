// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/photo_removal.h"

#include "engine/ingest/dense_removal.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/local_unplacing.h"
#include "engine/journal/journal.h"

namespace veduta {
namespace {

// What people have forbidden about a photo goes with it.
Status DeleteForbidden(const Snapshot& snapshot, ImageId image, Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ForbiddenRecord> all, snapshot.ListForbidden());
  for (const ForbiddenRecord& forbidden : all) {
    const bool names_it = forbidden.a == image.value || forbidden.b == image.value;
    if (forbidden.kind == ForbiddenKind::kPair && names_it)
      transaction->DeleteForbidden(forbidden.kind, forbidden.a, forbidden.b);
  }
  return Status::Ok();
}

// Takes the photo's pose, and heals what is around it.
Status Unplace(const IngestParts& parts, const WriteScope& scope, DatabaseState* state,
               RemovedPhoto* removed) {
  parts.TrimMap();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                          scope.base->GetObservations(removed->image));
  removed->observations = observations.size();
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord whole,
                          scope.base->GetReconstruction(removed->reconstruction));
  MapLoader loader(scope.base, parts.features, parts.map);
  VEDUTA_ASSIGN_OR_RETURN(
      removed->unplaced,
      UnplaceWithDependents({&removed->image, 1}, parts.options.mapper.observations_min, &loader,
                            parts.map));
  VEDUTA_RETURN_IF_ERROR(WriteUnplacedLocally(*parts.map, *scope.base, scope.transaction.get()));
  if (parts.map->changes().unplaced.size() == whole.image_count)
    VEDUTA_RETURN_IF_ERROR(DropHypotheses(*scope.base, whole.id, scope.transaction.get()));
  return PostponeImages(
      *scope.base, removed->unplaced, removed->reconstruction,
      "too few points hold it since image " + std::to_string(removed->image.value) + " was removed",
      state, scope.transaction.get());
}

}  // namespace

Result<RemovedPhoto> RemovePhoto(const IngestParts& parts, ImageId image, const std::string& actor,
                                 const std::string& why, WriteScope scope) {
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord record, scope.base->GetImage(image));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, scope.base->FindPose(image));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  RemovedPhoto removed;
  removed.image = image;
  removed.name = record.name;
  VEDUTA_RETURN_IF_ERROR(ForgetInHypotheses(*scope.base, image, transaction));
  if (pose) {
    removed.reconstruction = pose->reconstruction;
    VEDUTA_RETURN_IF_ERROR(Unplace(parts, scope, &state, &removed));
  }
  std::vector<ImageId> shaken = removed.unplaced;
  shaken.push_back(image);
  VEDUTA_ASSIGN_OR_RETURN(removed.was_dense, RemoveFromDense(*scope.base, shaken, transaction));
  VEDUTA_RETURN_IF_ERROR(DeleteForbidden(*scope.base, image, transaction));
  transaction->RemoveImage(image);
  std::erase(state.pending_propagation, image);
  if (record.verdict != Verdict::kRejected) --state.retrievable_image_count;
  state.removed_bytes_left = true;
  AppendJournal({0, 0, actor, "remove", image, {}, why}, &state, transaction);
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  parts.features->Forget(image);
  return removed;
}

}  // namespace veduta
