// SPDX-License-Identifier: Apache-2.0
#pragma once
// A reconstruction that has taken one place for another.

#include <vector>

#include "engine/ingest/placement_writer.h"
#include "engine/ingest/write_scope.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {

// Stores these cameras as one reconstruction, the second ones laid over the first by `over`. The
// images are stored.
inline ReconstructionId AddOverlaid(SceneDatabase* scene, const std::vector<uint32_t>& first,
                                    const std::vector<uint32_t>& second, const Sim3& over) {
  const ReconstructionId into = scene->AddReconstruction(first);
  const ReconstructionId from = scene->AddReconstruction(second, over);
  SceneWork work(scene);
  std::vector<ImageId> images;
  for (const ReconstructionId id : {into, from})
    EXPECT_OK(work.loader.LoadReconstruction(id, &images));
  for (const ImageId id : images) {
    work.map.MoveImage(id, into, Sim3());
    work.map.MoveBlock(id, into, Sim3());
  }
  Placement placement;
  placement.verdict = Verdict::kMerged;
  placement.reconstruction = into;
  placement.merges = {{from, Sim3(), 0, ""}};
  const WriteScope scope = BeginWrite(scene->database());
  DatabaseState state = scene->State();
  EXPECT_OK(WritePlacement(work.map, *scope.base, placement, {}, &state, scope.transaction.get()));
  scope.transaction->PutState(state);
  EXPECT_OK(scope.transaction->Commit());
  return into;
}

}  // namespace veduta
