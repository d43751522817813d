// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/placement_writer.h"

#include "engine/ingest/change_writer.h"
#include "engine/ingest/hypotheses.h"
#include "engine/ingest/retries.h"
#include "engine/ingest/submaps.h"
#include "engine/journal/journal.h"

namespace veduta {
namespace {

// The other two of the triple were postponed until now.
Status WriteTriple(const Snapshot& snapshot, const Placement& placement, Transaction* transaction) {
  for (size_t i = 1; i < placement.placed.size(); ++i) {
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord member, snapshot.GetImage(placement.placed[i]));
    member.verdict = Verdict::kFounded;
    member.reason = Reason::kGoodTriple;
    member.detail = "founded with image " + std::to_string(placement.placed.front().value);
    transaction->PutImage(member);
  }
  return Status::Ok();
}

// Merges that no photo led to follow by themselves, and have an action of their own.
void JournalMerges(const Placement& placement, DatabaseState* state, Transaction* transaction) {
  for (const Merge& merge : placement.merges) {
    JournalRecord entry;
    entry.actor = "veduta";
    entry.action = placement.placed.empty() ? "judge" : "merge";
    entry.reconstruction = placement.reconstruction;
    entry.detail =
        "reconstruction " + std::to_string(merge.from.value) + " by " +
        (merge.common_point_count > 0 ? std::to_string(merge.common_point_count) + " common points"
                                      : "what is seen across: " + merge.evidence);
    AppendJournal(std::move(entry), state, transaction);
  }
}

// Makes due the adjustment of the submap or reconstruction that the image is in, which judges it.
// Does nothing where the image is not valid().
Status WriteDoubt(const Snapshot& snapshot, ImageId doubtful, Transaction* transaction) {
  if (!doubtful.valid()) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(snapshot));
  if (submaps.FindOf(doubtful) != nullptr) {
    submaps.MakeDue({&doubtful, 1});
    submaps.Write(transaction);
    return Status::Ok();
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(doubtful));
  VEDUTA_CHECK(pose.has_value(), "an image without a pose raises no doubt");
  VEDUTA_ASSIGN_OR_RETURN(ReconstructionRecord record,
                          snapshot.GetReconstruction(pose->reconstruction));
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  return Status::Ok();
}

}  // namespace

Status WritePlacement(const CityMap& map, const Snapshot& snapshot, const Placement& placement,
                      std::span<const ImageId> unstored, DatabaseState* state,
                      Transaction* transaction) {
  if (placement.verdict == Verdict::kPostponed)
    return WriteDoubt(snapshot, placement.doubtful, transaction);
  VEDUTA_ASSIGN_OR_RETURN(Submaps submaps, Submaps::Read(snapshot));
  VEDUTA_RETURN_IF_ERROR(WritePlacementChanges(map, snapshot, placement, submaps, transaction));
  VEDUTA_RETURN_IF_ERROR(submaps.FollowPlacement(map, snapshot, placement));
  submaps.Write(transaction);
  if (placement.founded.valid()) {
    ++state->next_reconstruction;
    // By poses that came with a model; then the caller writes what its images are.
    const bool is_of_model = placement.verdict == Verdict::kPlaced;
    if (!is_of_model) VEDUTA_RETURN_IF_ERROR(WriteTriple(snapshot, placement, transaction));
  }
  JournalMerges(placement, state, transaction);
  VEDUTA_RETURN_IF_ERROR(WriteHypotheses(snapshot, placement, state, transaction));
  return AppendRetries(map, snapshot, placement, unstored, state);
}

}  // namespace veduta
