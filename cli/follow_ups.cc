// SPDX-License-Identifier: Apache-2.0
#include "cli/follow_ups.h"

#include "cli/output.h"
#include "cli/printable.h"

namespace veduta {
namespace {

// Its name, for a person; "#7" where the database cannot tell it.
std::string NameOf(ImageId id, const Questions& ask) {
  const std::string number = "#" + std::to_string(id.value);
  const Result<ImageAnswer> image = ask.Image(number);
  return image.ok() ? Printable(image->name) : number;
}

}  // namespace

std::string FollowUpText(const FollowUp& step, const Questions& ask) {
  switch (step.kind) {
    case FollowUpKind::kPropagation:
      return "the new attempt to place " + NameOf(step.image, ask);
    case FollowUpKind::kAdjustment:
      return "the adjustment of reconstruction " + std::to_string(step.reconstruction.value);
    case FollowUpKind::kJudgment:
      return "the new judgment of whether reconstructions " +
             std::to_string(step.reconstruction.value) + " and " +
             std::to_string(step.other.value) + " are one";
    case FollowUpKind::kGeoreference:
      return "the look for the place of reconstruction " +
             std::to_string(step.reconstruction.value) + " on the earth";
    case FollowUpKind::kVocabulary:
      return "the training of a vocabulary";
  }
  return "a step";
}

std::string FollowUpFailure(const FollowUp& step, const Questions& ask, const std::string& db) {
  return "veduta: " + FollowUpText(step, ask) + " failed: " + Printable(step.status.message()) +
         "; the photos are stored, and `veduta settle " + Printable(db) + "` tries it again";
}

std::string DamagedImageText(const DamagedImage& damaged, const Questions& ask,
                             const std::string& db) {
  return "veduta: what is stored of " + NameOf(damaged.image, ask) +
         " is damaged: " + Printable(damaged.what) +
         "; photos are added without it, and `veduta verify " + Printable(db) +
         "` names all that is damaged";
}

void PrintPlacedLater(const std::vector<ImageId>& placed, const Questions& ask) {
  for (const ImageId id : placed) {
    const Result<ImageAnswer> image = ask.Image("#" + std::to_string(id.value));
    if (!image.ok()) continue;
    PrintLine("%-10s %s: %s", "  then", Printable(image->name).c_str(),
              Printable(image->detail).c_str());
  }
}

void PrintHealed(const std::vector<LostPose>& unplaced,
                 const std::vector<ReconstructionId>& split_off, const Questions& ask) {
  for (const LostPose& image : unplaced) {
    PrintLine("%-10s %s: lost its pose: %s", "  then", NameOf(image.image, ask).c_str(),
              Printable(image.detail).c_str());
  }
  for (const ReconstructionId id : split_off)
    PrintLine("%-10s reconstruction %u was split off", "  then", id.value);
}

std::string JoinedText(const FollowUp& step) {
  if (!step.merged_into.valid()) return "";
  return "reconstructions " + std::to_string(step.reconstruction.value) + " and " +
         std::to_string(step.other.value) + " are one by all that is known now: reconstruction " +
         std::to_string(step.merged_into.value);
}

}  // namespace veduta
