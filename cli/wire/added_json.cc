// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/added_json.h"

namespace veduta {

std::string OutcomeWord(const AddOutcome& outcome) {
  if (!outcome.failure.ok()) return "failed";
  return outcome.duplicate ? "duplicate" : VerdictWord(outcome.verdict);
}

std::string OutcomeReason(const AddOutcome& outcome) {
  if (!outcome.failure.ok()) return outcome.failure.message();
  return outcome.duplicate ? outcome.detail : ReasonSentence(outcome.reason, outcome.detail);
}

std::string FollowUpWord(FollowUpKind kind) {
  switch (kind) {
    case FollowUpKind::kPropagation:
      return "propagation";
    case FollowUpKind::kAdjustment:
      return "adjustment";
    case FollowUpKind::kJudgment:
      return "judgment";
    case FollowUpKind::kVocabulary:
      return "vocabulary";
  }
  return "unknown";
}

Json ToJson(const DamagedImage& damaged) {
  return {{"id", ToJson(damaged.image)}, {"what", damaged.what}};
}

Json ToJson(const AddOutcome& outcome) {
  return {{"image", outcome.name},
          {"id", ToJson(outcome.id)},
          {"verdict", OutcomeWord(outcome)},
          {"reason", OutcomeReason(outcome)},
          {"reconstruction", ToJson(outcome.reconstruction)},
          {"neighbors", outcome.neighbor_count},
          {"inliers", outcome.inlier_count},
          {"pairs_tried", outcome.pairs_tried},
          {"propagated", ToJson(outcome.propagated)},
          {"unplaced", ToJson(outcome.unplaced)},
          {"split_off", ToJson(outcome.split_off)},
          {"damaged", ToJson(outcome.damaged)},
          {"ms", ToJson(outcome.times)}};
}

Json ToJson(const LostPose& lost) {
  return {{"id", lost.image.value}, {"why", lost.detail}};
}

Json ToJson(const StepTimes& times) {
  return {{"decode", times.decode_ms},     {"undistort", times.undistort_ms},
          {"features", times.features_ms}, {"retrieve", times.retrieve_ms},
          {"match", times.match_ms},       {"verify", times.verify_ms},
          {"map", times.map_ms},           {"adjust", times.adjust_ms},
          {"commit", times.commit_ms},     {"follow", times.follow_ms},
          {"total", times.total_ms}};
}

Json ToJson(const FollowUp& step) {
  return {{"step", FollowUpWord(step.kind)},
          {"image", ToJson(step.image)},
          {"reconstruction", ToJson(step.reconstruction)},
          {"other", ToJson(step.other)},
          {"merged_into", ToJson(step.merged_into)},
          {"placed", ToJson(step.placed)},
          {"unplaced", ToJson(step.unplaced)},
          {"split_off", ToJson(step.split_off)},
          {"error", step.status.ok() ? Json(nullptr) : Json(step.status.message())}};
}

}  // namespace veduta
