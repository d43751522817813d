// SPDX-License-Identifier: Apache-2.0
#pragma once
// A reconstruction of two sides that a few points hold together, and that verified pairs come to
// contradict: what a wrong merge looks like.

#include "tests/engine/ingest/scene_database.h"

namespace veduta {

// Cameras 0 to 3 see the one side, 4 to 7 the other.
inline constexpr SceneOptions kTwoSides{
    .camera_count = 8, .point_count = 1215, .arc_deg = 24, .beside = 7};

inline std::vector<ImageId> SideImages(uint32_t side) {
  std::vector<ImageId> ids;
  for (uint32_t k = 4 * side; k < 4 * side + 4; ++k) ids.push_back(ImageId(k + 1));
  return ids;
}

// All eight cameras at their true places, as one reconstruction.
inline ReconstructionId AddTwoSides(SceneDatabase* scene) {
  scene->AddImages(0, 8);
  return scene->AddReconstruction({0, 1, 2, 3, 4, 5, 6, 7});
}

// Four verified pairs between the sides, with many matches that no pose explains.
inline void ContradictSeam(SceneDatabase* scene) {
  const auto transaction = scene->database()->BeginTransaction();
  for (uint32_t k = 0; k < 4; ++k) {
    PairRecord pair = scene->scene().Pair(k, k + 4);
    pair.matches.clear();
    for (FeatureIndex f = 0; f < 200; ++f) pair.matches.push_back({f, (f * 83) % 200});
    transaction->PutPair(pair);
  }
  ASSERT_OK(transaction->Commit());
}

}  // namespace veduta
