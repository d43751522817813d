// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/due_work.h"

#include <algorithm>

#include "engine/ingest/submaps.h"

namespace veduta {

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
  const double step =
      std::max<double>(schedule.views_step, schedule.growth_share * record.images_at_adjustment);
  return record.image_count >= record.images_at_adjustment + step ||
         (record.images_at_adjustment == 0 && record.image_count > 0);
}

bool IsRelaxed(const ReconstructionRecord& record, bool is_parted,
               const AdjustmentSchedule& schedule) {
  return is_parted && record.image_count > schedule.whole_again_images_max;
}

Result<std::optional<DueStep>> FindDueStep(const Snapshot& snapshot,
                                           const AdjustmentSchedule& schedule,
                                           const Retrieval& retrieval,
                                           const StepsSetAside& set_aside) {
  const auto is_open = [&](const DueStep& step) { return !set_aside.Contains(step); };
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  for (const ImageId id : state.pending_propagation) {
    const DueStep step{FollowUpKind::kPropagation, id, {}, {}};
    if (is_open(step)) return std::optional(step);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> reconstructions,
                          snapshot.ListReconstructions());
  VEDUTA_ASSIGN_OR_RETURN(const Submaps submaps, Submaps::Read(snapshot));
  for (const ReconstructionRecord& record : reconstructions) {
    const bool is_parted = submaps.IsParted(record.id);
    const bool is_relaxed = IsRelaxed(record, is_parted, schedule);
    const bool is_due = IsAdjustmentDue(record, is_parted, schedule);
    DueStep step{FollowUpKind::kAdjustment, {}, record.id, {}};
    if (is_due && !is_relaxed && is_open(step)) return std::optional(step);
    // The motions of a relaxation are carried out before submaps are adjusted, since an adjustment
    // needs to know where its neighbours are. The relaxation rests on earlier adjustments itself.
    std::vector<SubmapId> ordered = submaps.ListMoving(record.id);
    for (const SubmapId submap : submaps.ListDue(record.id, schedule)) ordered.push_back(submap);
    for (const SubmapId submap : ordered) {
      step.submap = submap;
      if (is_open(step)) return std::optional(step);
    }
    step.submap = {};
    if (is_due && is_relaxed && is_open(step)) return std::optional(step);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> hypotheses,
                          snapshot.ListHypotheses());
  for (const HypothesisRecord& hypothesis : hypotheses) {
    const DueStep step{FollowUpKind::kJudgment, {}, hypothesis.a, hypothesis.b};
    if (hypothesis.is_due && is_open(step)) return std::optional(step);
  }
  const DueStep training{FollowUpKind::kVocabulary, {}, {}, {}};
  if (retrieval.IsTrainingDue(state) && is_open(training)) return std::optional(training);
  return std::optional<DueStep>();
}

}  // namespace veduta
