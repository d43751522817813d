// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/forbidding.h"

#include <algorithm>
#include <ctime>

#include "engine/ingest/dense_removal.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/pose_removal.h"
#include "engine/ingest/submaps.h"
#include "engine/journal/journal.h"
#include "engine/query/forbidden.h"

namespace veduta {
namespace {

std::string TwoText(ForbiddenKind kind, uint32_t a, uint32_t b) {
  return (kind == ForbiddenKind::kPair ? "images " : "reconstructions ") + std::to_string(a) +
         " and " + std::to_string(b);
}

std::string PoseText(ImageId image) {
  return "the pose of image " + std::to_string(image.value);
}

std::string WithReason(const std::string& what, const std::string& reason) {
  return what + (reason.empty() ? "" : ": " + reason);
}

// Fails unless these are two different stored photos that were not rejected.
Status CheckPhotos(const Snapshot& snapshot, ImageId a, ImageId b) {
  if (a == b) return Status::InvalidArgument("a photo and itself cannot be forbidden");
  for (const ImageId id : {a, b}) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord record, snapshot.GetImage(id));
    if (record.verdict == Verdict::kRejected)
      return Status::InvalidArgument(record.name + " was rejected and has no pairs");
  }
  return Status::Ok();
}

Status CheckReconstructions(const Snapshot& snapshot, ReconstructionId a, ReconstructionId b) {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId end_a, MergedEnd(snapshot, a));
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId end_b, MergedEnd(snapshot, b));
  if (end_a != end_b) return Status::Ok();
  return Status::InvalidArgument(TwoText(ForbiddenKind::kMerge, a.value, b.value) +
                                 " are one already: reconstruction " + std::to_string(end_a.value));
}

// Has the forbidden pair judged. A reconstruction that holds both images is judged anew, without
// the pair, by its next adjustment; otherwise the hypothesis that their two reconstructions are one
// is judged anew.
Status MakeJudgingDue(const Snapshot& snapshot, ImageId a, ImageId b, Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose_a, snapshot.FindPose(a));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose_b, snapshot.FindPose(b));
  if (!pose_a || !pose_b) return Status::Ok();
  if (pose_a->reconstruction != pose_b->reconstruction) {
    return MakeHypothesisDue(snapshot, pose_a->reconstruction, pose_b->reconstruction, transaction);
  }
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord record,
                          snapshot.GetReconstruction(pose_a->reconstruction));
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(snapshot));
  const ImageId both[] = {a, b};
  submaps.MakeDue(both);
  submaps.Write(transaction);
  return Status::Ok();
}

// Deletes the hypothesis that the two are one, for that is forbidden now.
Status DropForbidden(const Snapshot& snapshot, ReconstructionId a, ReconstructionId b,
                     Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId end_a, MergedEnd(snapshot, a));
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId end_b, MergedEnd(snapshot, b));
  transaction->DeleteHypothesis(end_a, end_b);
  return Status::Ok();
}

Status CommitWith(JournalRecord entry, DatabaseState state, const WriteScope& scope) {
  AppendJournal(std::move(entry), &state, scope.transaction.get());
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

// Takes the pose of the image, and the poses of images that too few points hold without it.
Status TakePose(const IngestParts& parts, const WriteScope& scope, const PoseRecord& pose,
                DatabaseState* state) {
  const std::string why = "too few points hold it since " + PoseText(pose.image) + " was forbidden";
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ImageId> unplaced,
                          RemovePose(parts, scope, pose, why, state));
  unplaced.push_back(pose.image);
  return RemoveFromDense(*scope.base, unplaced, scope.transaction.get()).status();
}

}  // namespace

Status Forbid(ForbiddenRecord forbidden, WriteScope scope) {
  if (forbidden.a > forbidden.b) std::swap(forbidden.a, forbidden.b);
  const bool is_pair = forbidden.kind == ForbiddenKind::kPair;
  VEDUTA_RETURN_IF_ERROR(is_pair
                             ? CheckPhotos(*scope.base, ImageId(forbidden.a), ImageId(forbidden.b))
                             : CheckReconstructions(*scope.base, ReconstructionId(forbidden.a),
                                                    ReconstructionId(forbidden.b)));
  VEDUTA_ASSIGN_OR_RETURN(const bool is_known,
                          scope.base->IsForbidden(forbidden.kind, forbidden.a, forbidden.b));
  if (is_known) return Status::Ok();
  forbidden.time_unix_s = std::time(nullptr);
  scope.transaction->PutForbidden(forbidden);
  if (is_pair) {
    const ImageId a(forbidden.a), b(forbidden.b);
    scope.transaction->DeletePair(a, b);
    VEDUTA_RETURN_IF_ERROR(MakeJudgingDue(*scope.base, a, b, scope.transaction.get()));
  } else {
    VEDUTA_RETURN_IF_ERROR(DropForbidden(*scope.base, ReconstructionId(forbidden.a),
                                         ReconstructionId(forbidden.b), scope.transaction.get()));
  }
  const std::string two = TwoText(forbidden.kind, forbidden.a, forbidden.b);
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  return CommitWith({0, 0, forbidden.actor, "forbid", {}, {}, WithReason(two, forbidden.reason)},
                    std::move(state), scope);
}

Status ForbidPose(const IngestParts& parts, ImageId image, const std::string& actor,
                  const std::string& reason, WriteScope scope) {
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(ImageRecord record, scope.base->GetImage(image));
  if (record.verdict == Verdict::kRejected)
    return Status::InvalidArgument(record.name + " was rejected and never has a pose");
  VEDUTA_ASSIGN_OR_RETURN(const bool is_known, IsPoseForbidden(*scope.base, image));
  if (is_known) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, scope.base->FindPose(image));
  if (pose) VEDUTA_RETURN_IF_ERROR(TakePose(parts, scope, *pose, &state));
  std::erase(state.pending_propagation, image);
  record.verdict = Verdict::kPostponed;
  record.reason = Reason::kForbidden;
  record.detail = kPoseForbiddenDetail;
  transaction->PutImage(record);
  transaction->PutForbidden(
      {ForbiddenKind::kPose, image.value, image.value, std::time(nullptr), actor, reason});
  VEDUTA_RETURN_IF_ERROR(
      CommitWith({0, 0, actor, "forbid", image, pose ? pose->reconstruction : ReconstructionId(),
                  WithReason(PoseText(image), reason)},
                 std::move(state), scope));
  parts.map->ClearChanges();
  return Status::Ok();
}

Status Allow(ForbiddenKind kind, uint32_t a, uint32_t b, const std::string& actor,
             const std::string& reason, WriteScope scope) {
  if (a > b) std::swap(a, b);
  const bool is_pose = kind == ForbiddenKind::kPose;
  const std::string what = is_pose ? PoseText(ImageId(a)) : TwoText(kind, a, b);
  VEDUTA_ASSIGN_OR_RETURN(const bool is_known, scope.base->IsForbidden(kind, a, b));
  if (!is_known) return Status::NotFound(what + (is_pose ? " is" : " are") + " not forbidden");
  scope.transaction->DeleteForbidden(kind, a, b);
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  const ImageId image = is_pose ? ImageId(a) : ImageId();
  std::vector<ImageId>& retries = state.pending_propagation;
  const bool is_tried = std::ranges::find(retries, image) != retries.end();
  if (is_pose && !is_tried) retries.push_back(image);
  return CommitWith({0, 0, actor, "allow", image, {}, WithReason(what, reason)}, std::move(state),
                    scope);
}

}  // namespace veduta
