// SPDX-License-Identifier: Apache-2.0
// Goal: tracks grow to what the scene holds, founding finds the scene from matches alone and
//   refuses planes of no depth and rotations, neighbours that contradict a pose are counted,
//   and the map's invariants survive every change.
// Method: a synthetic scene; every image's features are compared with the points that they
//   truly see.
#include "engine/mapping/growth.h"

#include <gtest/gtest.h>

#include <map>

#include "engine/mapping/founding.h"
#include "storage/base/transform.h"
#include "storage/model/pair.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

// Each track must hold features of one true point only. Returns the number of observations.
size_t CheckTracks(const Map& map, const SyntheticScene& scene) {
  size_t observations = 0;
  for (const auto& [id, image] : map.images()) {
    for (FeatureIndex f = 0; f < image.points.size(); ++f) {
      if (!image.points[f].valid()) continue;
      ++observations;
      const PointRecord& point = map.point(image.points[f]);
      const TrackElement& first = point.track.front();
      EXPECT_EQ(scene.seen[id.value - 1][f], scene.seen[first.image.value - 1][first.feature]);
      bool listed = false;
      for (const TrackElement& e : point.track) listed |= e.image == id && e.feature == f;
      EXPECT_TRUE(listed);
    }
  }
  return observations;
}

MapImage Unplaced(const MapImage& image) {
  MapImage copy = image;
  copy.points.assign(image.features->size(), PointId{});
  return copy;
}

TEST(Growth, MatchesBecomePointsAndTracks) {
  const SyntheticScene scene = MakeScene({});
  Map map;
  for (uint32_t k = 0; k < 4; ++k) {
    map.PlaceImage(Unplaced(scene.images[k]));
    std::vector<PairMatches> pairs;
    for (uint32_t j = 0; j < k; ++j)
      pairs.push_back(MatchesFrom(scene.Pair(j, k), scene.images[k].id));
    GrowFromMatches(&map, scene.images[k].id, pairs, {});
  }
  size_t visible = 0;
  for (uint32_t i = 0; i < scene.points.size(); ++i) {
    size_t views = 0;
    for (uint32_t k = 0; k < 4; ++k) views += scene.feature_of[k][i] >= 0;
    visible += views >= 2 ? views : 0;
  }
  EXPECT_GE(CheckTracks(map, scene), visible * 95 / 100);
  int64_t points = 0;
  for (const auto& [id, change] : map.changes().counts) points += change.points;
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  EXPECT_EQ(static_cast<size_t>(points), map.PointsSeenBy(ids).size());
}

TEST(Growth, ProjectionFindsWhatMatchingMissed) {
  const SyntheticScene scene = MakeScene({});
  Map map = MakeMap(scene);
  const ImageId self[] = {ImageId(4)};
  const std::vector<PointId> points = map.PointsSeenBy(self);
  const size_t before = CheckTracks(map, scene);
  size_t removed = 0;
  for (const PointId id : points) {
    if (map.point(id).track.size() > 3 && removed < 50)
      map.RemoveObservation(id, ImageId(4)), ++removed;
  }
  ASSERT_EQ(removed, 50u);
  EXPECT_GE(GrowByProjection(&map, ImageId(4), points, {}).observations_added, 48u);
  EXPECT_GE(CheckTracks(map, scene), before - 2);
}

TEST(Growth, SplitPointsAreMerged) {
  const SyntheticScene scene = MakeScene({});
  Map map;
  for (uint32_t k = 0; k < 5; ++k) map.PlaceImage(Unplaced(scene.images[k]));
  // One true point twice: seen by images 1 and 2, and by 4 and 5.
  uint32_t target = 0;
  while (scene.feature_of[0][target] < 0 || scene.feature_of[1][target] < 0 ||
         scene.feature_of[2][target] < 0 || scene.feature_of[3][target] < 0 ||
         scene.feature_of[4][target] < 0) {
    ++target;
  }
  const auto element = [&](uint32_t k) {
    return TrackElement{scene.images[k].id, static_cast<FeatureIndex>(scene.feature_of[k][target])};
  };
  const PointId one = map.AddPoint(ImageId(1), scene.points[target], {element(0), element(1)});
  const PointId two = map.AddPoint(ImageId(4), scene.points[target], {element(3), element(4)});
  std::vector<PairMatches> pairs;
  for (const uint32_t j : {0u, 1u, 3u, 4u}) {
    PairMatches pair;
    pair.other = scene.images[j].id;
    pair.matches = {{element(2).feature, element(j).feature}};
    pairs.push_back(pair);
  }
  GrowFromMatches(&map, ImageId(3), pairs, {});
  const PointRecord* kept = map.FindPoint(one) ? map.FindPoint(one) : map.FindPoint(two);
  ASSERT_NE(kept, nullptr);
  EXPECT_EQ(kept->track.size(), 5u);
  EXPECT_TRUE(map.FindPoint(one) == nullptr || map.FindPoint(two) == nullptr);
}

FoundingViews ViewsOf(const SyntheticScene& scene, uint32_t count) {
  FoundingViews views;
  for (uint32_t k = 0; k < count; ++k) views.images.push_back(Unplaced(scene.images[k]));
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = i + 1; j < count; ++j) views.pairs.push_back(scene.Pair(i, j));
  }
  return views;
}

TEST(Founding, FindsTheSceneFromMatches) {
  const SyntheticScene scene = MakeScene({});
  Map map;
  ASSERT_EQ(Found(ViewsOf(scene, 5), ImageId(2), ReconstructionId(7), 1, {}, &map),
            FoundingOutcome::kFounded);
  EXPECT_EQ(map.images().size(), 3u);
  EXPECT_TRUE(map.HasImage(ImageId(2)));
  CheckTracks(map, scene);
  // Relative rotations do not depend on the frame.
  const auto first = map.images().begin(), last = std::prev(map.images().end());
  const Rigid3 found = last->second.cam_from_world * first->second.cam_from_world.Inverse();
  const Rigid3 truth =
      scene.poses[last->first.value - 1] * scene.poses[first->first.value - 1].Inverse();
  EXPECT_LT(RotationErrorDeg(found, truth), 0.3);
}

TEST(Founding, RefusesRotations) {
  SceneOptions options;
  options.rotation = true;
  const SyntheticScene scene = MakeScene(options);
  FoundingViews views = ViewsOf(scene, 4);
  for (PairRecord& pair :
       views.pairs) {  // what two-view estimation would name, and what it might miss
    pair.geometry = PairGeometry::kRotation;
    pair.b_from_a.translation = Eigen::Vector3d::UnitX();
  }
  Map map;
  EXPECT_EQ(Found(views, ImageId(1), ReconstructionId(1), 1, {}, &map), FoundingOutcome::kNoPair);
  for (PairRecord& pair : views.pairs) pair.geometry = PairGeometry::kGeneral;
  EXPECT_NE(Found(views, ImageId(1), ReconstructionId(1), 1, {}, &map), FoundingOutcome::kFounded);
  EXPECT_TRUE(map.images().empty());
}

TEST(Placement, CountsNeighborsThatContradict) {
  const SyntheticScene scene = MakeScene({});
  const Map map = MakeMap(scene);
  std::vector<PairMatches> pairs;
  for (const uint32_t j : {0u, 1u, 3u}) pairs.push_back(MatchesFrom(scene.Pair(j, 2), ImageId(3)));
  const MapImage& image = scene.images[2];
  NeighborAgreement agreement = CheckNeighbors(map, ReconstructionId(1), scene.poses[2],
                                               *image.features, image.camera, pairs, 4);
  EXPECT_EQ(agreement.agreeing_images, 3u);
  EXPECT_EQ(agreement.contradicting_images, 0u);
  Rigid3 elsewhere = scene.poses[2];  // one window further along a repeated facade
  elsewhere.translation += Eigen::Vector3d(0, 1.0, 0);
  agreement =
      CheckNeighbors(map, ReconstructionId(1), elsewhere, *image.features, image.camera, pairs, 4);
  EXPECT_EQ(agreement.agreeing_images, 0u);
  EXPECT_EQ(agreement.contradicting_images, 3u);
}

}  // namespace
}  // namespace veduta
