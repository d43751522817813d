// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/photo_removal.h"

#include <ctime>

#include "engine/ingest/dense_removal.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/pose_removal.h"
#include "engine/journal/journal.h"
#include "engine/query/visibility.h"

namespace veduta {
namespace {

// Deletes what people have forbidden about the photo.
Status DeleteForbidden(const Snapshot& snapshot, ImageId image, Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ForbiddenRecord> all, snapshot.ListForbidden());
  for (const ForbiddenRecord& forbidden : all) {
    const bool names_it = forbidden.a == image.value || forbidden.b == image.value;
    if (forbidden.kind != ForbiddenKind::kMerge && names_it)
      transaction->DeleteForbidden(forbidden.kind, forbidden.a, forbidden.b);
  }
  return Status::Ok();
}

// That the photo was hidden stays known, so that the journal does not tell then who had sent it;
// its reports are resolved, and lose what was written about it.
Status CloseReports(const Snapshot& snapshot, const ImageRecord& image, const std::string& actor,
                    Transaction* transaction) {
  const ModerationReader& moderation = snapshot.moderation();
  VEDUTA_ASSIGN_OR_RETURN(const bool was_hidden, IsHidden(snapshot, image));
  if (was_hidden) {
    transaction->PutHidden(
        {HiddenKind::kImage, image.id.value, std::time(nullptr), actor, "it was hidden before"});
  }
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ReportRecord> reports, moderation.ListReports());
  for (ReportRecord& report : reports) {
    if (report.image != image.id) continue;
    report.text.clear();
    if (report.state == ReportState::kOpen) {
      report.state = ReportState::kErased;
      report.resolver = actor;
      report.resolved_unix_s = std::time(nullptr);
    }
    transaction->PutReport(report);
  }
  return Status::Ok();
}

// Deletes where the photo shows surveyed points.
Status DeleteSightings(const Snapshot& snapshot, ImageId image, Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<GroundPoint> points, snapshot.ListGroundPoints());
  for (GroundPoint& point : points) {
    const auto is_of_image = [&](const GroundSighting& s) { return s.image == image; };
    if (std::erase_if(point.sightings, is_of_image) > 0) transaction->PutGroundPoint(point);
  }
  return Status::Ok();
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
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                            scope.base->GetObservations(image));
    removed.observations = observations.size();
    VEDUTA_ASSIGN_OR_RETURN(removed.unplaced,
                            RemovePose(parts, scope, *pose,
                                       "too few points hold it since image " +
                                           std::to_string(image.value) + " was removed",
                                       &state));
  }
  std::vector<ImageId> shaken = removed.unplaced;
  shaken.push_back(image);
  VEDUTA_ASSIGN_OR_RETURN(removed.was_dense, RemoveFromDense(*scope.base, shaken, transaction));
  VEDUTA_RETURN_IF_ERROR(DeleteForbidden(*scope.base, image, transaction));
  VEDUTA_RETURN_IF_ERROR(DeleteSightings(*scope.base, image, transaction));
  VEDUTA_RETURN_IF_ERROR(CloseReports(*scope.base, record, actor, transaction));
  transaction->RemoveImage(image);
  std::erase(state.pending_propagation, image);
  if (record.verdict != Verdict::kRejected) --state.retrievable_image_count;
  state.removed_bytes_left = true;
  AppendJournal({0, 0, actor, "remove", image, {}, why}, &state, transaction);
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  parts.map->ClearChanges();
  parts.features->Forget(image, record.photo);
  return removed;
}

}  // namespace veduta
