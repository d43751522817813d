// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/forbidding.h"

#include <algorithm>
#include <ctime>

#include "engine/ingest/hypotheses.h"
#include "engine/journal/journal.h"
#include "engine/query/forbidden.h"

namespace veduta {
namespace {

std::string TwoText(ForbiddenKind kind, uint32_t a, uint32_t b) {
  return (kind == ForbiddenKind::kPair ? "images " : "reconstructions ") + std::to_string(a) +
         " and " + std::to_string(b);
}

std::string EntryText(ForbiddenKind kind, uint32_t a, uint32_t b, const std::string& reason) {
  return TwoText(kind, a, b) + (reason.empty() ? "" : ": " + reason);
}

// That the two exist, and are not one.
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

// A reconstruction that holds both is judged anew, without the pair, by its next adjustment; a
// hypothesis that the two of them are one, by a judgment.
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
  return Status::Ok();
}

// What is forbidden is no hypothesis any more.
Status DropForbidden(const Snapshot& snapshot, ReconstructionId a, ReconstructionId b,
                     Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId end_a, MergedEnd(snapshot, a));
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId end_b, MergedEnd(snapshot, b));
  transaction->DeleteHypothesis(end_a, end_b);
  return Status::Ok();
}

Status Journal(const std::string& action, const std::string& actor, const std::string& detail,
               const WriteScope& scope) {
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  AppendJournal({0, 0, actor, action, {}, {}, detail}, &state, scope.transaction.get());
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
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
  return Journal("forbid", forbidden.actor,
                 EntryText(forbidden.kind, forbidden.a, forbidden.b, forbidden.reason), scope);
}

Status Allow(ForbiddenKind kind, uint32_t a, uint32_t b, const std::string& actor,
             const std::string& reason, WriteScope scope) {
  if (a > b) std::swap(a, b);
  VEDUTA_ASSIGN_OR_RETURN(const bool is_known, scope.base->IsForbidden(kind, a, b));
  if (!is_known) return Status::NotFound(TwoText(kind, a, b) + " are not forbidden");
  scope.transaction->DeleteForbidden(kind, a, b);
  return Journal("allow", actor, EntryText(kind, a, b, reason), scope);
}

}  // namespace veduta
