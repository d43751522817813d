// SPDX-License-Identifier: Apache-2.0
#pragma once
// A reconstruction of two sides that a few points hold together, and that verified pairs come to
// contradict: what a wrong merge looks like.

#include <set>

#include "engine/matching/two_view.h"
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

// A pair as if camera `b`, of the second side, saw what its twin in the first side sees: each
// feature of `a` is matched with one of `b` that lies on its epipolar line.
inline PairRecord FalsePair(const SyntheticScene& scene, uint32_t a, uint32_t b) {
  PairRecord pair = scene.Pair(a, b);
  pair.matches.clear();
  pair.b_from_a = scene.poses[b - 4] * scene.poses[a].Inverse();
  pair.b_from_a.translation.normalize();
  const auto ray = [&](uint32_t k, FeatureIndex f) {
    return scene.camera.Normalize(scene.images[k].features->keypoints[f]);
  };
  const double error = 0.3 / scene.camera.fx;
  std::vector<Eigen::Vector2d> rays_a, rays_b;
  std::set<FeatureIndex> taken;
  for (FeatureIndex f = 0; f < scene.seen[a].size() && pair.matches.size() < 200; ++f) {
    for (FeatureIndex g = 0; g < scene.seen[b].size(); ++g) {
      const Eigen::Vector2d x_a[] = {ray(a, f)}, x_b[] = {ray(b, g)};
      if (taken.contains(g) || FindTwoViewInliers(pair.b_from_a, x_a, x_b, error).empty()) continue;
      taken.insert(g);
      pair.matches.push_back({f, g});
      rays_a.push_back(x_a[0]), rays_b.push_back(x_b[0]);
      break;
    }
  }
  // The geometry is the best for the matches, and explains them, as that of a pair that was
  // verified.
  const double distance_max = TwoViewOptions().error_px_max / scene.camera.fx;
  pair.b_from_a = RefineTwoView(pair.b_from_a, rays_a, rays_b, 0.5 * distance_max);
  PairRecord explained = pair;
  explained.matches.clear();
  for (const uint32_t i : FindTwoViewInliers(pair.b_from_a, rays_a, rays_b, distance_max))
    explained.matches.push_back(pair.matches[i]);
  return explained;
}

// Eight verified pairs between the sides, with many matches that the poses do not explain.
inline void ContradictSeam(SceneDatabase* scene) {
  const auto transaction = scene->database()->BeginTransaction();
  for (uint32_t k = 0; k < 4; ++k) {
    for (const uint32_t along : {1u, 2u})
      transaction->PutPair(FalsePair(scene->scene(), k, 4 + (k + along) % 4));
  }
  ASSERT_OK(transaction->Commit());
}

}  // namespace veduta
