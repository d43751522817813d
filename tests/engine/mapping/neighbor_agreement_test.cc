// SPDX-License-Identifier: Apache-2.0
// Goal: neighbours that agree with a pose and those that contradict it are counted; a pair whose
//   own rotation is another one is noticed, and where its matches are narrow only if it is far off.
// Method: a synthetic scene; the pose is the true one, and then one window further along; a pair
//   whose rotation is turned, with all its matches and with those of a strip of the picture.
#include "engine/mapping/neighbor_agreement.h"

#include <gtest/gtest.h>

#include <cmath>

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

TEST(NeighborAgreement, ARotationOfItsOwnIsAskedOfMatchesThatAreSpread) {
  const SyntheticScene scene = MakeScene({.point_count = 2000});
  const CityMap map = MakeMap(scene);
  const MapImage &view = map.image(ImageId(3)), &other = map.image(ImageId(2));
  const PairMatches right = MatchesFrom(scene.Pair(1, 2), ImageId(3));
  ASSERT_EQ(right.geometry, PairGeometry::kGeneral);
  PairMatches narrow = right;
  std::erase_if(narrow.matches, [&](const FeatureMatch& match) {
    return std::abs(view.features->keypoints[match.a].x_px - 0.5 * view.width_px) >
           0.1 * view.width_px;
  });
  const AgreementOptions options{.rotation_px_max = 1};
  ASSERT_GE(narrow.matches.size(), options.rotation_matches_min);
  const auto turned = [](PairMatches pair, double degrees) {
    pair.other_from_photo.rotation =
        Eigen::AngleAxisd(degrees * 0.017453292519943295, Eigen::Vector3d::UnitY()) *
        pair.other_from_photo.rotation;
    return pair;
  };
  for (const PairMatches& pair : {right, narrow})
    EXPECT_FALSE(IsTurned(view, other, turned(pair, 1), options));
  EXPECT_TRUE(IsTurned(view, other, turned(right, 4), options));
  EXPECT_FALSE(IsTurned(view, other, turned(narrow, 4), options));
  EXPECT_TRUE(IsTurned(view, other, turned(narrow, 12), options));
  EXPECT_TRUE(IsTurned(view, other, turned(narrow, 4), {.rotation_narrow_factor = 1}));
  // That was by another focal length; by that of now it finds the right one.
  PairMatches old = turned(right, 4);
  old.lens_photo.focal_px = old.lens_other.focal_px = 1.05 * view.camera.focal_px();
  EXPECT_FALSE(IsTurned(view, other, old, options));
}

}  // namespace
}  // namespace veduta
