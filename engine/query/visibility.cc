// SPDX-License-Identifier: Apache-2.0
#include "engine/query/visibility.h"

#include <optional>

#include "engine/query/forbidden.h"

namespace veduta {

Result<bool> IsHidden(const Snapshot& snapshot, const ImageRecord& image) {
  const ModerationReader& moderation = snapshot.moderation();
  VEDUTA_ASSIGN_OR_RETURN(const bool is_hidden,
                          moderation.IsHidden(HiddenKind::kImage, image.id.value));
  if (is_hidden || image.contribution == 0) return is_hidden;
  return moderation.IsHidden(HiddenKind::kContribution, image.contribution);
}

Result<bool> Visibility::IsInScope(const ImageRecord& image) const {
  if (sight_.contribution != 0) return image.contribution == sight_.contribution;
  if (!sight_.reconstruction.valid()) return true;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot_.FindPose(image.id));
  if (!pose) return false;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId end, MergedEnd(snapshot_, sight_.reconstruction));
  return pose->reconstruction == end;
}

Result<bool> Visibility::IsOnTheWay(ReconstructionId reconstruction) const {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId end, MergedEnd(snapshot_, sight_.reconstruction));
  for (ReconstructionId at = sight_.reconstruction; at != end;) {
    if (at == reconstruction) return true;
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, snapshot_.GetReconstruction(at));
    at = record.merged_into;
  }
  return reconstruction == end;
}

Result<bool> Visibility::Sees(const ImageRecord& image) const {
  if (SeesAll()) return true;
  VEDUTA_ASSIGN_OR_RETURN(const bool is_in_scope, IsInScope(image));
  if (!is_in_scope) return false;
  if (sight_.sees_hidden) return true;
  VEDUTA_ASSIGN_OR_RETURN(const bool is_hidden, IsHidden(snapshot_, image));
  return !is_hidden;
}

Result<bool> Visibility::Sees(ImageId image) const {
  if (SeesAll()) return true;
  const Result<ImageRecord> record = snapshot_.GetImage(image);
  if (record.ok()) return Sees(*record);
  if (record.status().code() != StatusCode::kNotFound) return record.status();
  if (!SeesWhole()) return false;
  VEDUTA_ASSIGN_OR_RETURN(const bool is_hidden,
                          snapshot_.moderation().IsHidden(HiddenKind::kImage, image.value));
  return !is_hidden;
}

Result<bool> Visibility::Sees(ReconstructionId reconstruction) const {
  if (SeesWhole()) return true;
  if (sight_.reconstruction.valid()) return IsOnTheWay(reconstruction);
  bool is_found = false;
  Status failure;
  VEDUTA_RETURN_IF_ERROR(snapshot_.contributing().ScanContributedPhotos(
      sight_.contribution, 0, [&](const ContributedPhoto& photo) {
        if (photo.fate != ContributionFate::kStored) return true;
        const Result<std::optional<PoseRecord>> pose = snapshot_.FindPose(photo.image);
        failure = pose.status();
        is_found = pose.ok() && *pose && (*pose)->reconstruction == reconstruction;
        return pose.ok() && !is_found;
      }));
  VEDUTA_RETURN_IF_ERROR(failure);
  return is_found;
}

Result<bool> Visibility::SeesContribution(uint32_t number) const {
  if (SeesAll()) return true;
  if (sight_.reconstruction.valid()) return false;
  if (sight_.contribution != 0 && sight_.contribution != number) return false;
  if (sight_.sees_hidden) return true;
  VEDUTA_ASSIGN_OR_RETURN(const bool is_hidden,
                          snapshot_.moderation().IsHidden(HiddenKind::kContribution, number));
  return !is_hidden;
}

}  // namespace veduta
