// SPDX-License-Identifier: Apache-2.0
// Goal: the map's invariants hold through every change, its record of changes names what changed
//   and counts what grew, and what is loaded is no change.
// Method: a synthetic scene placed at the truth, changed in each way.
#include "engine/mapping/city_map.h"

#include <gtest/gtest.h>

#include <set>

#include "scene_checks.h"

namespace veduta {
namespace {

CountChange Totals(const CityMap& map) {
  CountChange totals;
  for (const auto& [id, image] : map.images()) {
    for (const PointRecord& point : map.StoredBlock(id).points) {
      ++totals.points;
      totals.observations += static_cast<int64_t>(point.track.size());
      totals.reprojection_error_px_sum += point.error_px * static_cast<double>(point.track.size());
    }
  }
  return totals;
}

void ExpectCounted(const CityMap& map) {
  const CountChange totals = Totals(map), counted = map.changes().counts.begin()->second;
  EXPECT_EQ(counted.points, totals.points);
  EXPECT_EQ(counted.observations, totals.observations);
  EXPECT_NEAR(counted.reprojection_error_px_sum, totals.reprojection_error_px_sum, 1e-6);
}

PointId LongTrack(const CityMap& map, size_t length) {
  const ImageId first[] = {ImageId(1)};
  for (const PointId id : map.PointsSeenBy(first)) {
    if (map.point(id).track.size() >= length) return id;
  }
  ADD_FAILURE() << "no such track";
  return {};
}

TEST(CityMap, CountsWhatChanges) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  ExpectCounted(map);
  EXPECT_EQ(static_cast<size_t>(Totals(map).observations), CheckTracks(map, scene));
  const PointId id = LongTrack(map, 4);
  map.RemoveObservation(id, ImageId(1));
  EXPECT_EQ(map.point(id).track.size() + 1, MakeMap(scene).point(id).track.size());
  map.SetPosition(id, map.point(id).position + Eigen::Vector3d(0.1, 0, 0));
  ExpectCounted(map);
  map.RemovePoint(id);
  EXPECT_EQ(map.FindPoint(id), nullptr);
  ExpectCounted(map);
  CheckTracks(map, scene);
}

TEST(CityMap, ListsThePointsThatImagesSee) {
  CityMap map = MakeMap(MakeScene({.camera_count = 8}));
  for (uint32_t ordinal = 2; ordinal < 40; ordinal += 3) {
    if (map.FindPoint({ImageId(1), ordinal}) != nullptr) map.RemovePoint({ImageId(1), ordinal});
  }
  std::vector<ImageId> some;
  for (uint32_t id = 1; id <= 8; ++id) {
    some.insert(some.begin(), ImageId(id));  // in any order
    std::set<PointId> expected;
    for (const ImageId image : some) {
      for (const PointId point : map.image(image).points) {
        if (point.valid()) expected.insert(point);
      }
    }
    EXPECT_EQ(map.PointsSeenBy(some), std::vector(expected.begin(), expected.end()));
  }
}

TEST(CityMap, ATrackOfOneIsNoPoint) {
  CityMap map = MakeMap(MakeScene({.camera_count = 2}));
  const PointId id = LongTrack(map, 2);
  const FeatureIndex feature = map.point(id).track[1].feature;
  map.RemoveObservation(id, ImageId(1));
  EXPECT_EQ(map.FindPoint(id), nullptr);
  EXPECT_FALSE(map.image(ImageId(2)).points[feature].valid());
  ExpectCounted(map);
}

TEST(CityMap, MergedPointsShareTheirTracks) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  const PointId whole = LongTrack(map, 4);
  const std::vector<TrackElement> track = map.point(whole).track;
  const Eigen::Vector3d position = map.point(whole).position;
  map.RemovePoint(whole);
  const PointId keep = map.AddPoint(track[0].image, position, {track[1], track[0]});
  const PointId drop = map.AddPoint(track[2].image, position, {track[2], track[3]});
  EXPECT_FALSE(map.SharesImage(map.point(keep), map.point(drop)));
  map.MergePoints(keep, drop);
  EXPECT_EQ(map.FindPoint(drop), nullptr);
  EXPECT_EQ(map.point(keep).track, std::vector(track.begin(), track.begin() + 4));
  for (size_t i = 0; i < 4; ++i)
    EXPECT_EQ(map.image(track[i].image).points[track[i].feature], keep);
  ExpectCounted(map);
}

TEST(CityMap, LoadedStateIsNoChangeAndOrdinalsAreNotUsedAgain) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene), loaded;
  map.RemovePoint(LongTrack(map, 3));
  for (const auto& [id, image] : map.images()) {
    loaded.LoadImage(image);
    loaded.LoadBlock(map.StoredBlock(id));
  }
  EXPECT_TRUE(loaded.changes().poses.empty() && loaded.changes().blocks.empty() &&
              loaded.changes().observations.empty() && loaded.changes().counts.empty());
  EXPECT_EQ(CheckTracks(loaded, scene), CheckTracks(map, scene));
  EXPECT_EQ(loaded.StoredBlock(ImageId(1)).next_ordinal, map.StoredBlock(ImageId(1)).next_ordinal);
}

TEST(CityMap, MovesIntoAnotherFrame) {
  CityMap map = MakeMap(MakeScene({}));
  const Sim3 into_from_old{
      2, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX())), {1, 2, 3}};
  const PointId id = LongTrack(map, 3);
  const Eigen::Vector3d position = map.point(id).position;
  const Eigen::Vector3d seen = map.image(ImageId(1)).cam_from_world * position;
  map.ClearChanges();
  map.MoveImage(ImageId(1), ReconstructionId(5), into_from_old);
  map.MoveBlock(id.home, ReconstructionId(5), into_from_old);
  EXPECT_EQ(map.image(ImageId(1)).reconstruction, ReconstructionId(5));
  EXPECT_LT((map.point(id).position - into_from_old * position).norm(), 1e-12);
  const Eigen::Vector3d still = map.image(ImageId(1)).cam_from_world * map.point(id).position;
  EXPECT_LT((still / still.z() - seen / seen.z()).norm(), 1e-12);
  EXPECT_TRUE(map.changes().poses.contains(ImageId(1)));
  EXPECT_TRUE(map.changes().blocks.contains(id.home));
  map.Clear();
  EXPECT_TRUE(map.images().empty() && map.changes().poses.empty());
}

// Every point lies in a block that is there, in a reconstruction with all its images.
void ExpectHomes(const CityMap& map) {
  for (const auto& [id, image] : map.images()) {
    for (const PointRecord& point : map.StoredBlock(id).points) {
      EXPECT_EQ(point.id.home, id);
      EXPECT_GE(point.track.size(), 2u);
      for (const TrackElement& element : point.track)
        EXPECT_EQ(map.image(element.image).points[element.feature], point.id);
    }
  }
}

TEST(CityMap, AnImageIsUnplaced) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  const PointId id = LongTrack(map, 4);
  ASSERT_EQ(id.home, ImageId(1));
  const PointRecord before = map.point(id);
  map.ClearChanges();
  const CountChange total = Totals(map);
  map.UnplaceImage(ImageId(1));
  EXPECT_FALSE(map.HasImage(ImageId(1)));
  EXPECT_FALSE(map.HasBlock(ImageId(1)));
  EXPECT_EQ(map.changes().unplaced,
            (std::map<ImageId, ReconstructionId>{{ImageId(1), ReconstructionId(1)}}));
  EXPECT_FALSE(map.changes().poses.contains(ImageId(1)));
  EXPECT_FALSE(map.changes().blocks.contains(ImageId(1)));
  EXPECT_FALSE(map.changes().observations.contains(ImageId(1)));
  CheckTracks(map, scene);
  ExpectHomes(map);
  // What grew is what there is now beyond what there was.
  const CountChange change = map.changes().counts.at(ReconstructionId(1)), now = Totals(map);
  EXPECT_EQ(total.points + change.points, now.points);
  EXPECT_EQ(total.observations + change.observations, now.observations);
  EXPECT_NEAR(total.reprojection_error_px_sum + change.reprojection_error_px_sum,
              now.reprojection_error_px_sum, 1e-6);
  // The point that it was home to lives with the first of the others.
  const TrackElement& second = before.track[1];
  const PointId moved = map.image(second.image).points[second.feature];
  EXPECT_EQ(moved.home, second.image);
  EXPECT_EQ(map.point(moved).position, before.position);
  EXPECT_EQ(map.point(moved).track, std::vector(before.track.begin() + 1, before.track.end()));
  // No other point is lost but those that only one image sees now.
  size_t seen_by_two = 0;
  for (uint32_t i = 0; i < scene.points.size(); ++i) {
    size_t views = 0;
    for (uint32_t k = 1; k < scene.images.size(); ++k) views += scene.feature_of[k][i] >= 0;
    seen_by_two += views >= 2;
  }
  EXPECT_EQ(static_cast<size_t>(now.points), seen_by_two);
}

TEST(CityMap, PointsForgetTheColoursOfAnImageThatIsUnplaced) {
  SyntheticScene scene = MakeScene({});
  const auto bright = std::make_shared<Features>(*scene.images[0].features);
  for (Keypoint& keypoint : bright->keypoints) keypoint.rgb = {240, 120, 60};
  scene.images[0].features = bright;
  CityMap map = MakeMap(scene);
  EXPECT_GT(map.point(LongTrack(map, 4)).rgb[0], 0);
  map.UnplaceImage(ImageId(1));
  for (const auto& [id, image] : map.images()) {
    for (const PointRecord& point : map.StoredBlock(id).points)
      EXPECT_EQ(point.rgb, (std::array<uint8_t, 3>{}));
  }
}

TEST(CityMap, AnImageHasAnotherPictureOfTheSame) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  map.ClearChanges();
  const CountChange total = Totals(map);
  const MapImage before = map.image(ImageId(1));
  // The same features in the opposite order, in a picture of twice the size; one has no
  // counterpart.
  const FeatureIndex count = static_cast<FeatureIndex>(before.features->size());
  auto features = std::make_shared<Features>(*before.features);
  std::ranges::reverse(features->keypoints);
  for (Keypoint& keypoint : features->keypoints) {
    keypoint.x_px = 2 * keypoint.x_px + 0.5f;
    keypoint.y_px = 2 * keypoint.y_px + 0.5f;
  }
  MapImage with = before;
  with.features = features;
  with.camera.fx *= 2;
  with.camera.fy *= 2;
  with.camera.cx = 2 * with.camera.cx + 0.5;
  with.camera.cy = 2 * with.camera.cy + 0.5;
  with.points.clear();
  FeatureIndex lost = 0;
  while (!before.points[lost].valid() || map.point(before.points[lost]).track.size() < 3) ++lost;
  std::vector<FeatureMatch> counterparts;
  for (FeatureIndex f = 0; f < count; ++f) {
    if (f != lost) counterparts.push_back({f, count - 1 - f});
  }
  map.ExchangePicture(with, counterparts);
  const MapImage& after = map.image(ImageId(1));
  EXPECT_EQ(after.cam_from_world.translation, before.cam_from_world.translation);
  for (FeatureIndex f = 0; f < count; ++f) {
    const PointId point = after.points[count - 1 - f];
    EXPECT_EQ(point, f == lost ? PointId() : before.points[f]);
    if (!point.valid()) continue;
    const auto& track = map.point(point).track;
    EXPECT_NE(std::ranges::find(track, TrackElement{ImageId(1), count - 1 - f}), track.end());
    EXPECT_LT(ReprojectionErrorPx(after.ViewOf(count - 1 - f), map.point(point).position), 10);
  }
  for (const TrackElement& element : map.point(before.points[lost]).track)
    EXPECT_NE(element.image, ImageId(1));
  const CountChange change = map.changes().counts.at(ReconstructionId(1)), now = Totals(map);
  EXPECT_EQ(change.points, 0);
  EXPECT_EQ(change.observations, -1);
  EXPECT_EQ(total.observations + change.observations, now.observations);
  EXPECT_NEAR(total.reprojection_error_px_sum + change.reprojection_error_px_sum,
              now.reprojection_error_px_sum, 1e-6);
  EXPECT_TRUE(map.changes().observations.contains(ImageId(1)));
  EXPECT_TRUE(map.changes().unplaced.empty());
}

TEST(CityMap, AnImageThatIsHomeToNothingIsUnplaced) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  map.UnplaceImage(ImageId(6));
  EXPECT_EQ(map.images().size(), 5u);
  CheckTracks(map, scene);
  ExpectHomes(map);
  ExpectCounted(map);
}

TEST(CityMap, APartIsCutOff) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  const std::set<ImageId> part = {ImageId(1), ImageId(2), ImageId(4)};
  // Every other point of image 1 is seen by more images outside of the part.
  for (const PointRecord& point : map.StoredBlock(ImageId(1)).points) {
    if (point.id.ordinal % 2 == 0 && point.track.size() > 2)
      map.RemoveObservation(point.id, ImageId(1));
  }
  std::map<PointId, PointRecord> before;
  for (const ImageId id : {ImageId(1), ImageId(2), ImageId(3), ImageId(4), ImageId(5), ImageId(6)})
    for (const PointRecord& point : map.StoredBlock(id).points) before[point.id] = point;
  map.CutOff(part);
  EXPECT_TRUE(map.changes().unplaced.empty());
  ExpectHomes(map);
  ExpectCounted(map);
  CheckTracks(map, scene);
  size_t kept_inside = 0, kept_outside = 0;
  for (const auto& [id, point] : before) {
    std::vector<TrackElement> inside, outside;
    for (const TrackElement& e : point.track)
      (part.contains(e.image) ? inside : outside).push_back(e);
    const bool stays_inside = inside.size() >= outside.size();
    const std::vector<TrackElement>& kept = stays_inside ? inside : outside;
    const std::vector<TrackElement>& lost = stays_inside ? outside : inside;
    for (const TrackElement& e : lost) EXPECT_FALSE(map.image(e.image).points[e.feature].valid());
    const PointId now = map.image(kept.front().image).points[kept.front().feature];
    EXPECT_EQ(now.valid(), kept.size() >= 2);
    if (!now.valid()) continue;
    EXPECT_EQ(map.point(now).track, kept);
    EXPECT_EQ(map.point(now).position, point.position);
    EXPECT_EQ(part.contains(now.home), stays_inside);
    ++(stays_inside ? kept_inside : kept_outside);
  }
  EXPECT_GT(kept_inside, 20u);
  EXPECT_GT(kept_outside, 20u);
}

TEST(CityMap, CuttingOffWhatStandsAloneChangesNothing) {
  const SyntheticScene scene = MakeScene({});
  CityMap map = MakeMap(scene);
  map.CutOff({ImageId(1), ImageId(2), ImageId(3)});
  map.ClearChanges();
  map.CutOff({ImageId(1), ImageId(2), ImageId(3)});
  EXPECT_TRUE(map.changes().blocks.empty());
  EXPECT_TRUE(map.changes().observations.empty());
}

}  // namespace
}  // namespace veduta
