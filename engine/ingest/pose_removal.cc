// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/pose_removal.h"

#include "engine/ingest/hypotheses.h"
#include "engine/ingest/local_unplacing.h"

namespace veduta {

Result<std::vector<ImageId>> RemovePose(const IngestParts& parts, const WriteScope& scope,
                                        const PoseRecord& pose, const std::string& why,
                                        DatabaseState* state) {
  parts.TrimMap();
  Transaction* const transaction = scope.transaction.get();
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord whole,
                          scope.base->GetReconstruction(pose.reconstruction));
  MapLoader loader(scope.base, parts.features, parts.map, parts.pool);
  VEDUTA_ASSIGN_OR_RETURN(
      std::vector<ImageId> unplaced,
      UnplaceWithDependents({&pose.image, 1}, parts.options.mapper.observations_min, &loader,
                            parts.map));
  VEDUTA_RETURN_IF_ERROR(WriteChangedLocally(*parts.map, *scope.base, transaction));
  if (parts.map->changes().unplaced.size() == whole.image_count)
    VEDUTA_RETURN_IF_ERROR(DropHypotheses(*scope.base, whole.id, transaction));
  VEDUTA_RETURN_IF_ERROR(
      PostponeImages(*scope.base, unplaced, pose.reconstruction, why, state, transaction));
  return unplaced;
}

}  // namespace veduta
