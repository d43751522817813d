// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/due_work.h"

#include <algorithm>

#include "engine/ingest/georeferencing.h"
#include "engine/ingest/submaps.h"

namespace veduta {
namespace {

const DueStep kTraining{FollowUpKind::kVocabulary, {}, {}, {}, {}, true};

// The step for all of the reconstruction: its adjustment, or parting it, which is short.
DueStep WholeOf(const ReconstructionRecord& record, bool is_parted,
                const AdjustmentSchedule& schedule) {
  const bool is_long = is_parted || (record.image_count > schedule.region_images_max &&
                                     record.image_count <= schedule.whole_images_max);
  return {FollowUpKind::kAdjustment, {}, record.id, {}, {}, is_long};
}

}  // namespace

void StepsSetAside::Add(const DueStep& step) {
  switch (step.kind) {
    case FollowUpKind::kPropagation:
      propagations_.insert(step.image);
      return;
    case FollowUpKind::kAdjustment:
      adjustments_.insert({step.reconstruction, step.submap});
      return;
    case FollowUpKind::kJudgment:
      judgments_.insert({step.reconstruction, step.other});
      return;
    case FollowUpKind::kGeoreference:
      georeferences_.insert(step.reconstruction);
      return;
    case FollowUpKind::kVocabulary:
      vocabulary_ = true;
      return;
  }
}

bool StepsSetAside::Contains(const DueStep& step) const {
  switch (step.kind) {
    case FollowUpKind::kPropagation:
      return propagations_.contains(step.image);
    case FollowUpKind::kAdjustment:
      return adjustments_.contains({step.reconstruction, step.submap});
    case FollowUpKind::kJudgment:
      return judgments_.contains({step.reconstruction, step.other});
    case FollowUpKind::kGeoreference:
      return georeferences_.contains(step.reconstruction);
    case FollowUpKind::kVocabulary:
      break;
  }
  return vocabulary_;
}

bool IsAdjustmentDue(const ReconstructionRecord& record, bool is_parted,
                     const AdjustmentSchedule& schedule) {
  if (!record.is_living()) return false;
  if (is_parted && record.images_at_adjustment > 0) {
    const double share = IsRelaxed(record, is_parted, schedule) ? schedule.relaxation_share
                                                                : schedule.whole_again_share;
    return record.image_count >= record.images_at_adjustment * (1 + share);
  }
  const double share = record.image_count > schedule.region_images_max ? schedule.long_growth_share
                                                                       : schedule.growth_share;
  const double step = std::max<double>(schedule.views_step, share * record.images_at_adjustment);
  return record.image_count >= record.images_at_adjustment + step ||
         (record.images_at_adjustment == 0 && record.image_count > 0);
}

bool IsRelaxed(const ReconstructionRecord& record, bool is_parted,
               const AdjustmentSchedule& schedule) {
  return is_parted && record.image_count > schedule.whole_again_images_max;
}

bool KeepsBorders(const ReconstructionRecord& record, bool is_parted,
                  const AdjustmentSchedule& schedule) {
  return is_parted &&
         record.image_count * (1 + schedule.whole_again_share) > schedule.whole_again_images_max;
}

Result<std::optional<DueStep>> FindDueStep(const Snapshot& snapshot,
                                           const AdjustmentSchedule& schedule,
                                           const Retrieval& retrieval,
                                           const StepsSetAside& set_aside,
                                           const std::optional<DueStep>& at_work) {
  const auto is_open = [&](const DueStep& step) {
    const bool waits =
        at_work && (step.is_long || (step.kind == FollowUpKind::kAdjustment &&
                                     step.reconstruction == at_work->reconstruction));
    return !waits && !set_aside.Contains(step);
  };
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  for (const ImageId id : state.pending_propagation) {
    const DueStep step{FollowUpKind::kPropagation, id, {}, {}};
    if (is_open(step)) return std::optional(step);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> reconstructions,
                          snapshot.ListReconstructions());
  VEDUTA_ASSIGN_OR_RETURN(const Submaps submaps, Submaps::Read(snapshot));
  for (const ReconstructionRecord& record : reconstructions) {
    if (!record.is_living()) continue;
    const bool is_parted = submaps.IsParted(record.id);
    const bool is_relaxed = IsRelaxed(record, is_parted, schedule);
    const bool is_due = IsAdjustmentDue(record, is_parted, schedule);
    const DueStep whole = WholeOf(record, is_parted, schedule);
    const auto first_open = [&](const std::vector<SubmapId>& among) {
      DueStep step{FollowUpKind::kAdjustment, {}, record.id, {}};
      for (const SubmapId submap : among) {
        step.submap = submap;
        if (is_open(step)) return std::optional(step);
      }
      return std::optional<DueStep>();
    };
    // Motions are carried out before anything is adjusted, since an adjustment needs to know where
    // its neighbours are. A relaxation rests on earlier adjustments of submaps itself.
    if (const auto moving = first_open(submaps.ListMoving(record.id))) return moving;
    if (is_due && !is_relaxed && is_open(whole)) return std::optional(whole);
    if (const auto due = first_open(submaps.ListDue(record.id, schedule))) return due;
    if (is_due && is_relaxed && is_open(whole)) return std::optional(whole);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> hypotheses,
                          snapshot.ListHypotheses());
  for (const HypothesisRecord& hypothesis : hypotheses) {
    const DueStep step{FollowUpKind::kJudgment, {}, hypothesis.a, hypothesis.b};
    if (hypothesis.is_due && is_open(step)) return std::optional(step);
  }
  VEDUTA_ASSIGN_OR_RETURN(const bool is_place_told, IsPlaceTold(snapshot, state));
  for (const ReconstructionRecord& record : reconstructions) {
    const DueStep step{FollowUpKind::kGeoreference, {}, record.id};
    if (IsLookDue(record, is_place_told) && is_open(step)) return std::optional(step);
  }
  if (retrieval.IsTrainingDue(state) && is_open(kTraining)) return std::optional(kTraining);
  return std::optional<DueStep>();
}

Result<std::optional<DueStep>> FindLongStep(const Snapshot& snapshot,
                                            const AdjustmentSchedule& schedule,
                                            const Retrieval& retrieval,
                                            const StepsSetAside& set_aside) {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  if (retrieval.IsTrainingDue(state) && !set_aside.Contains(kTraining))
    return std::optional(kTraining);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> reconstructions,
                          snapshot.ListReconstructions());
  VEDUTA_ASSIGN_OR_RETURN(const Submaps submaps, Submaps::Read(snapshot));
  for (const ReconstructionRecord& record : reconstructions) {
    if (!record.is_living()) continue;
    const bool is_parted = submaps.IsParted(record.id);
    const DueStep whole = WholeOf(record, is_parted, schedule);
    if (!whole.is_long || !IsAdjustmentDue(record, is_parted, schedule) ||
        set_aside.Contains(whole))
      continue;
    const bool submaps_first =
        !submaps.ListMoving(record.id).empty() ||
        (IsRelaxed(record, is_parted, schedule) && !submaps.ListDue(record.id, schedule).empty());
    if (!submaps_first) return std::optional(whole);
  }
  return std::optional<DueStep>();
}

}  // namespace veduta
