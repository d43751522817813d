// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/surface_settings.h"

namespace veduta {

Result<bool> IsMoving(const Snapshot& snapshot, ReconstructionId reconstruction) {
  VEDUTA_ASSIGN_OR_RETURN(const auto staged,
                          snapshot.dense().FindSettings(StagedSurfaceOf(reconstruction)));
  if (!staged) return false;
  VEDUTA_ASSIGN_OR_RETURN(const auto own, snapshot.dense().FindSettings(reconstruction));
  return own && own->voxel_size == staged->voxel_size;
}

Result<std::optional<DenseSettings>> FindLastSettings(const Snapshot& snapshot,
                                                      ReconstructionId reconstruction) {
  VEDUTA_ASSIGN_OR_RETURN(std::optional<DenseSettings> last,
                          snapshot.dense().FindSettings(StagedSurfaceOf(reconstruction)));
  if (!last) return snapshot.dense().FindSettings(reconstruction);
  last->reconstruction = reconstruction;
  return last;
}

}  // namespace veduta
