// SPDX-License-Identifier: Apache-2.0
// Goal: neighbours that agree with a pose and those that contradict it are counted.
// Method: a synthetic scene; the pose is the true one, and then one window further along.
#include "engine/mapping/neighbor_agreement.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

TEST(NeighborAgreement, CountsThoseThatContradict) {
  const SyntheticScene scene = MakeScene({});
  const CityMap map = MakeMap(scene);
  std::vector<PairMatches> pairs;
  for (const uint32_t j : {0u, 1u, 3u}) pairs.push_back(MatchesFrom(scene.Pair(j, 2), ImageId(3)));
  const AgreementOptions options{.line_error_px_max = 4};
  MapImage view = scene.images[2];
  view.cam_from_world = scene.poses[2];
  NeighborAgreement agreement = CheckNeighbors(map, ReconstructionId(1), view, pairs, options);
  EXPECT_EQ(agreement.agreeing_images, 3u);
  EXPECT_EQ(agreement.contradicting_images, 0u);
  // One window further along a repeated facade.
  view.cam_from_world.translation += Eigen::Vector3d(0, 1.0, 0);
  agreement = CheckNeighbors(map, ReconstructionId(1), view, pairs, options);
  EXPECT_EQ(agreement.agreeing_images, 0u);
  EXPECT_EQ(agreement.contradicting_images, 3u);
}

}  // namespace
}  // namespace veduta
