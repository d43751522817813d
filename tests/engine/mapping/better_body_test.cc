// SPDX-License-Identifier: Apache-2.0
// Goal: images that stand wrong as one body are carried to where they belong, and those that stand
//   right stay; bodies are groups that share more with each other than with the rest.
// Method: a synthetic scene of two sides that a few points hold together; one side is carried away
//   with its points.
#include "engine/mapping/better_body.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

constexpr SceneOptions kTwoSides{
    .camera_count = 8, .point_count = 1230, .arc_deg = 24, .beside = 7, .seam_point_count = 30};

std::vector<ImageId> Side(uint32_t side) {
  std::vector<ImageId> ids;
  for (uint32_t k = 1; k <= 4; ++k) ids.push_back(ImageId(4 * side + k));
  return ids;
}

std::vector<BodyPair> PairsAcross(const SyntheticScene& scene) {
  std::vector<BodyPair> pairs;
  for (uint32_t a = 4; a < 8; ++a) {
    for (uint32_t b = 0; b < 4; ++b)
      pairs.push_back({ImageId(a + 1), MatchesFrom(scene.Pair(b, a), ImageId(a + 1))});
  }
  return pairs;
}

// The second side stands elsewhere, with all that it sees.
CityMap MakeTornMap(const SyntheticScene& scene, const Sim3& there_from_here) {
  CityMap map = MakeMap(scene);
  map.CutOff({ImageId(5), ImageId(6), ImageId(7), ImageId(8)});
  for (const ImageId id : Side(1)) {
    map.MoveImage(id, ReconstructionId(1), there_from_here);
    map.MoveBlock(id, ReconstructionId(1), there_from_here);
  }
  return map;
}

double LargestError(const CityMap& map, const SyntheticScene& scene, const Sim3& carried) {
  double largest = 0;
  for (uint32_t k = 4; k < 8; ++k) {
    const Eigen::Vector3d center = carried * map.image(ImageId(k + 1)).cam_from_world.Center();
    largest = std::max(largest, (center - scene.poses[k].Center()).norm());
  }
  return largest;
}

TEST(BetterBody, IsCarriedBackFromNearAndFar) {
  const SyntheticScene scene = MakeScene(kTwoSides);
  for (const double turn_rad : {0.01, 0.05, 0.2}) {
    SCOPED_TRACE("turned by " + std::to_string(turn_rad));
    Sim3 away;
    away.scale = 1.02;
    away.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY()));
    away.translation = Eigen::Vector3d(0.2, 0, 0.1);
    const CityMap map = MakeTornMap(scene, away);
    EXPECT_GT(LargestError(map, scene, Sim3()), 0.1);
    const auto back = FindBetterPlace(map, Side(1), PairsAcross(scene));
    ASSERT_TRUE(back.has_value());
    EXPECT_LT(LargestError(map, scene, *back), 0.02);
  }
}

// Two thirds of the matches are wrong, as among windows that look alike.
TEST(BetterBody, IsCarriedBackThoughMuchThatIsSeenIsWrong) {
  const SyntheticScene scene = MakeScene(kTwoSides);
  std::vector<BodyPair> pairs = PairsAcross(scene);
  for (BodyPair& pair : pairs) {
    std::vector<FeatureMatch>& matches = pair.matches.matches;
    for (size_t i = 0; i + 1 < matches.size(); i += 3) std::swap(matches[i].b, matches[i + 1].b);
  }
  for (const double turn_rad : {0.02, 0.05, 0.1, 0.2, 0.3}) {
    SCOPED_TRACE("turned by " + std::to_string(turn_rad));
    const Sim3 away{1,
                    Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY())),
                    {0.2, 0, 0.1}};
    const CityMap map = MakeTornMap(scene, away);
    const auto back = FindBetterPlace(map, Side(1), pairs);
    ASSERT_TRUE(back.has_value());
    EXPECT_LT(LargestError(map, scene, *back), 0.02);
  }
}

TEST(BetterBody, StaysWhereNothingSaysOtherwise) {
  const SyntheticScene scene = MakeScene(kTwoSides);
  EXPECT_FALSE(FindBetterPlace(MakeMap(scene), Side(1), PairsAcross(scene)).has_value());
  const CityMap torn = MakeTornMap(scene, {1, Eigen::Quaterniond::Identity(), {0.2, 0, 0}});
  EXPECT_FALSE(FindBetterPlace(torn, Side(1), {}).has_value()) << "there are no pairs";
  EXPECT_TRUE(FindBetterPlace(torn, Side(1), PairsAcross(scene)).has_value());
}

TEST(BetterBody, BodiesShareMoreWithEachOtherThanWithTheRest) {
  const CityMap map = MakeMap(MakeScene(kTwoSides));
  std::vector<ImageId> all = Side(0);
  const std::vector<ImageId> other = Side(1);
  all.insert(all.end(), other.begin(), other.end());
  const std::vector<std::vector<ImageId>> bodies = ListBodies(map, all, 4);
  ASSERT_FALSE(bodies.empty());
  EXPECT_EQ(bodies.back(), other) << "the sides are joined last";
  for (const std::vector<ImageId>& body : bodies) {
    EXPECT_GE(body.size(), 2u);
    EXPECT_TRUE(std::ranges::is_sorted(body));
  }
  for (const std::vector<ImageId>& body : ListBodies(map, all, 3)) EXPECT_LE(body.size(), 3u);
  EXPECT_TRUE(ListBodies(map, {}, 4).empty());
}

}  // namespace
}  // namespace veduta
