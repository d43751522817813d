// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/told_scene.h"

#include "engine/query/unsure_poses.h"

namespace veduta {

Result<Scene> LoadToldScene(const Snapshot& snapshot, ReconstructionId reconstruction) {
  VEDUTA_ASSIGN_OR_RETURN(Scene scene, LoadScene(snapshot, reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(const UnsureImages unsure, ListUnsure(snapshot));
  std::erase_if(scene.images, [&](const auto& image) { return unsure.contains(image.first); });
  return scene;
}

}  // namespace veduta
