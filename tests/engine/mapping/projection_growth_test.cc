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

// Half of the points are left to the first three cameras of the arc, and more cameras stand on it
// than are looked at side by side.
CityMap TornMap(const SyntheticScene& scene) {
  CityMap map = MakeMap(scene);
  for (const PointId id : map.PointsSeenBy(AllImages(map))) {
    const std::vector<TrackElement> track = map.point(id).track;
    if (id.ordinal % 2 == 1) continue;
    for (size_t i = 3; i < track.size(); ++i) map.RemoveObservation(id, track[i].image);
  }
  return map;
}

// Three of four observations are gone, so that a few images around another one see few of its
// points, and with each that is found again other images may share most.
CityMap SparseMap(const SyntheticScene& scene) {
  CityMap map = MakeMap(scene);
  SeededRandom random(7);
  for (const ImageId id : AllImages(map)) {
    for (const PointId point : map.PointsSeenBy({&id, 1})) {
      if (map.point(point).track.size() > 2 && random.Below(4) > 0)
        map.RemoveObservation(point, id);
    }
  }
  return map;
}

void ExpectSameAtAnyThreads(const SyntheticScene& scene, size_t covisible_max,
                            CityMap (*torn)(const SyntheticScene&)) {
  CityMap plain = torn(scene);
  uint32_t added = 0;
  for (const ImageId id : AllImages(plain)) {
    const std::vector<ImageId> near = CovisibleImages(plain, id, covisible_max);
    added += GrowByProjection(&plain, id, plain.PointsSeenBy(near), {}).observations_added;
  }
  EXPECT_GT(added, 1000u);
  for (const size_t threads : {0, 1, 3}) {
    ThreadPool pool(threads);
    CityMap map = torn(scene);
    const auto counts = GrowAllByProjection(&map, AllImages(map), {}, covisible_max, {}, &pool);
    EXPECT_EQ(counts.observations_added, added);
    for (const auto& [id, image] : plain.images()) EXPECT_EQ(map.image(id).points, image.points);
  }
}

TEST(ProjectionGrowth, ManyAtOnceEqualOneAfterAnother) {
  // Views of a point that differ by more than 45 degrees are not compared. So it matters to the
  // cameras further along the arc which of those between have joined a track already.
  const SceneOptions options{
      .camera_count = 75, .point_count = 200, .noise_px = 1.5, .arc_deg = 150};
  ExpectSameAtAnyThreads(MakeScene(options), 40, TornMap);
  for (const size_t covisible_max : {2, 4, 8})
    ExpectSameAtAnyThreads(MakeScene(options), covisible_max, SparseMap);
}

}  // namespace
}  // namespace veduta
