// SPDX-License-Identifier: Apache-2.0
// Goal: wrong observations leave their tracks, wrong and flat points go, and good ones stay.
// Method: a synthetic map at the truth, with single observations and points moved away.
#include "engine/mapping/point_filter.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

std::vector<ImageId> AllImages(const CityMap& map) {
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  return ids;
}

TEST(PointFilter, RemovesAWrongObservationAlone) {
  SyntheticScene scene = MakeScene({.noise_px = 0.1});
  // One keypoint of image 2 lies 9 px off.
  uint32_t target = 0;
  while (scene.feature_of[1][target] < 0 || scene.feature_of[0][target] < 0 ||
         scene.feature_of[2][target] < 0 || scene.feature_of[3][target] < 0) {
    ++target;
  }
  auto moved = std::make_shared<Features>(*scene.images[1].features);
  moved->keypoints[static_cast<size_t>(scene.feature_of[1][target])].x_px += 9;
  scene.images[1].features = moved;
  CityMap map = MakeMap(scene);
  const PointId id = map.image(ImageId(1)).points[static_cast<size_t>(scene.feature_of[0][target])];
  const size_t before = map.point(id).track.size();
  const PointFilterCounts counts = FilterPoints(&map, map.PointsSeenBy(AllImages(map)), {});
  EXPECT_EQ(counts.observations_removed, 1u);
  EXPECT_EQ(counts.points_removed, 0u);
  EXPECT_EQ(map.point(id).track.size(), before - 1);
}

TEST(PointFilter, RemovesWrongObservationsAndFlatPoints) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  const auto points = map.PointsSeenBy(AllImages(map));
  const PointId moved = points[3], kept = points[5];
  ASSERT_GE(map.point(moved).track.size(), 3u);
  map.SetPosition(moved, map.point(moved).position + Eigen::Vector3d(0, 0.5, 0));
  const PointFilterCounts counts = FilterPoints(&map, points, {});
  EXPECT_EQ(map.FindPoint(moved), nullptr);
  EXPECT_NE(map.FindPoint(kept), nullptr);
  EXPECT_GE(counts.points_removed, 1u);
  EXPECT_LT(counts.points_removed, 10u);
  PointFilterOptions wide;
  wide.angle_deg_min = 80;  // nothing is seen from so far apart
  FilterPoints(&map, points, wide);
  EXPECT_TRUE(map.PointsSeenBy(AllImages(map)).empty());
}

// Where the line between two cameras meets their pictures, any two features agree upon a depth.
TEST(PointFilter, TwoViewsOfWhatDiffersInSizeAreNoPoint) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  const auto points = map.PointsSeenBy(AllImages(map));
  std::vector<PointId> chosen;  // alike, larger in one view, smaller there, and seen by a third
  for (const PointId id : points) {
    if (map.point(id).track.size() >= 3 && chosen.size() < 4) chosen.push_back(id);
  }
  ASSERT_EQ(chosen.size(), 4u);
  const float times[] = {2, 3, 0.3F, 8};
  for (size_t i = 0; i < chosen.size(); ++i) {
    while (i < 3 && map.point(chosen[i]).track.size() > 2)
      map.RemoveObservation(chosen[i], map.point(chosen[i]).track.back().image);
    const TrackElement first = map.point(chosen[i]).track.front();
    MapImage image = map.image(first.image);
    auto resized = std::make_shared<Features>(*image.features);
    resized->keypoints[first.feature].scale_px *= times[i];
    image.features = resized;
    map.LoadImage(image);
  }
  FilterPoints(&map, points, {});
  EXPECT_NE(map.FindPoint(chosen[0]), nullptr);
  EXPECT_EQ(map.FindPoint(chosen[1]), nullptr);
  EXPECT_EQ(map.FindPoint(chosen[2]), nullptr);
  EXPECT_NE(map.FindPoint(chosen[3]), nullptr);
  PointFilterOptions none;
  none.size_octaves_max = 0;
  EXPECT_FALSE(none.Check().ok());
}

}  // namespace
}  // namespace veduta
