// SPDX-License-Identifier: Apache-2.0
#include "engine/query/forbidden.h"

#include <set>

namespace veduta {

Result<ReconstructionId> MergedEnd(const Snapshot& snapshot, ReconstructionId id) {
  std::set<ReconstructionId> seen;
  for (ReconstructionId at = id;;) {
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, snapshot.GetReconstruction(at));
    if (!record.merged_into.valid()) return at;
    if (!seen.insert(at).second) {
      return Status::Corruption("family reconstructions: reconstruction " +
                                std::to_string(id.value) + " was merged into itself");
    }
    at = record.merged_into;
  }
}

Result<bool> IsPoseForbidden(const Snapshot& snapshot, ImageId image) {
  return snapshot.IsForbidden(ForbiddenKind::kPose, image.value, image.value);
}

Result<bool> IsMergeForbidden(const Snapshot& snapshot, ReconstructionId a, ReconstructionId b) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ForbiddenRecord> all, snapshot.ListForbidden());
  for (const ForbiddenRecord& forbidden : all) {
    if (forbidden.kind != ForbiddenKind::kMerge) continue;
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId first,
                            MergedEnd(snapshot, ReconstructionId(forbidden.a)));
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId second,
                            MergedEnd(snapshot, ReconstructionId(forbidden.b)));
    if ((first == a && second == b) || (first == b && second == a)) return true;
  }
  return false;
}

}  // namespace veduta
