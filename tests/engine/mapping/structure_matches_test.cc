// SPDX-License-Identifier: Apache-2.0
// Goal: the points that a photo sees are those that most of its placed neighbours name.
// Method: a synthetic scene; one neighbour is made to name wrong points.
#include "engine/mapping/structure_matches.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

TEST(StructureMatches, TheMajorityNamesThePoint) {
  const SyntheticScene scene = MakeScene({});
  const CityMap map = MakeMap(scene);
  std::vector<PairMatches> pairs;
  for (const uint32_t j : {0u, 1u, 2u}) pairs.push_back(MatchesFrom(scene.Pair(j, 3), ImageId(4)));
  for (size_t i = 0; i + 1 < pairs[0].matches.size(); i += 2)  // the first neighbour is confused
    std::swap(pairs[0].matches[i].b, pairs[0].matches[i + 1].b);
  const MapImage& image = scene.images[3];
  const StructureMatches found =
      GatherStructure(map, ReconstructionId(1), *image.features, image.camera, pairs);
  ASSERT_GT(found.features.size(), 100u);
  size_t wrong = 0;
  for (size_t i = 0; i < found.features.size(); ++i) {
    const uint32_t truth = scene.seen[3][found.features[i]];
    wrong += found.positions[i] != scene.points[truth];
    EXPECT_EQ(found.positions[i], map.point(found.points[i]).position);
    EXPECT_EQ(found.x[i], image.camera.Normalize(image.features->keypoints[found.features[i]]));
  }
  EXPECT_LT(wrong, found.features.size() / 10) << "only where the confused one is alone";
  EXPECT_TRUE(GatherStructure(map, ReconstructionId(2), *image.features, image.camera, pairs)
                  .features.empty());
  EXPECT_TRUE(GatherStructure(map, ReconstructionId(1), *image.features, image.camera, pairs,
                              [](const PointRecord&) { return false; })
                  .features.empty());
}

}  // namespace
}  // namespace veduta
