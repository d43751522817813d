// SPDX-License-Identifier: Apache-2.0
// Goal: projection completes tracks by what images truly see; many images grown side by side give
//   what one after another gives.
// Method: synthetic scenes that some observations are taken from. The plain way is a loop over the
//   images with the members that the growth of all is said to equal.
#include "engine/mapping/projection_growth.h"

#include <gtest/gtest.h>

#include "engine/mapping/covisible_images.h"
#include "scene_checks.h"

namespace veduta {
namespace {

std::vector<ImageId> AllImages(const CityMap& map) {
  std::vector<ImageId> ids;
  for (const auto& [id, image] : map.images()) ids.push_back(id);
  return ids;
}

TEST(ProjectionGrowth, FindsWhatMatchingMissed) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
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

// More cameras than are looked at side by side at once, and two of three observations gone.
CityMap TornMap(const SyntheticScene& scene) {
  CityMap map = MakeMap(scene);
  SeededRandom random(7);
  for (const ImageId id : AllImages(map)) {
    for (const PointId point : map.PointsSeenBy({&id, 1})) {
      if (map.point(point).track.size() > 3 && random.Below(3) > 0)
        map.RemoveObservation(point, id);
    }
  }
  return map;
}

TEST(ProjectionGrowth, ManyAtOnceEqualOneAfterAnother) {
  // The views turn by 50 degrees in all, and descriptors beyond 45 degrees are not compared, so it
  // matters which images have joined a track already.
  const SyntheticScene scene =
      MakeScene({.camera_count = 75, .point_count = 200, .noise_px = 1.5, .arc_deg = 50});
  CityMap plain = TornMap(scene);
  const size_t before = CheckTracks(plain, scene);
  uint32_t added = 0;
  for (const ImageId id : AllImages(plain)) {
    added += GrowByProjection(&plain, id, plain.PointsSeenBy(CovisibleImages(plain, id, 12)), {})
                 .observations_added;
  }
  EXPECT_GT(added, before);
  for (const size_t threads : {0, 1, 3}) {
    ThreadPool pool(threads);
    CityMap map = TornMap(scene);
    const GrowthCounts counts = GrowAllByProjection(&map, AllImages(map), 12, {}, &pool);
    EXPECT_EQ(counts.observations_added, added);
    for (const auto& [id, image] : plain.images()) EXPECT_EQ(map.image(id).points, image.points);
  }
}

}  // namespace
}  // namespace veduta
