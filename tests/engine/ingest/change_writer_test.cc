// SPDX-License-Identifier: Apache-2.0
// Goal: what changed in the map is what is stored, with the counts of the reconstructions, for a
//   placement, a merge and an adjustment of the whole; every invariant between records holds after.
// Method: a synthetic scene in a database; the records are compared with the map, and `verify`'s
//   own check looks over them.
#include "engine/ingest/change_writer.h"

#include <gtest/gtest.h>

#include <numeric>

#include "engine/ingest/photo_placement.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

void ExpectSound(const Snapshot& snapshot) {
  const auto violations = FindViolations(snapshot, 20);
  ASSERT_OK(violations);
  for (const std::string& violation : *violations) ADD_FAILURE() << violation;
}

// The stored counts are those of the stored points.
void ExpectTrueCounts(const Snapshot& snapshot, ReconstructionId id) {
  const ReconstructionRecord record = *snapshot.GetReconstruction(id);
  uint64_t points = 0, observations = 0;
  double sum = 0;
  EXPECT_OK(snapshot.ScanPointBlocks(id, record.points_generation, [&](const PointBlock& block) {
    for (const PointRecord& point : block.points) {
      ++points;
      observations += point.track.size();
      sum += point.error_px * static_cast<double>(point.track.size());
    }
    return true;
  }));
  EXPECT_EQ(record.point_count, points);
  EXPECT_EQ(record.observation_count, observations);
  EXPECT_NEAR(record.reprojection_error_px_sum, sum, 1e-3);
}

void Commit(SceneDatabase* scene, const CityMap& map, const Placement& placement) {
  DatabaseState state = scene->State();
  const auto transaction = scene->database()->BeginTransaction();
  ASSERT_OK(WritePlacementChanges(map, *scene->Snap(), placement, {}, transaction.get()));
  for (const ImageId id : placement.placed) {
    ImageRecord record = *scene->Snap()->GetImage(id);
    record.verdict = placement.verdict;
    record.reason = placement.reason;
    transaction->PutImage(record);
  }
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
}

TEST(ChangeWriter, WritesAFoundedReconstruction) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2});  // by WritePlacementChanges
  const CityMap map = scene.MapOf({0, 1, 2}, id);
  const auto snapshot = scene.Snap();
  for (uint32_t k = 0; k < 3; ++k) {
    EXPECT_EQ((*snapshot->FindPose(ImageId(k + 1)))->reconstruction, id);
    EXPECT_EQ(*snapshot->GetObservations(ImageId(k + 1)),
              ObservationsOf(map.image(ImageId(k + 1))));
  }
  EXPECT_EQ(snapshot->GetReconstruction(id)->image_count, 3u);
  ExpectTrueCounts(*snapshot, id);
  ExpectSound(*snapshot);
}

TEST(ChangeWriter, WritesAPlacedPhotoAndAMerge) {
  SceneDatabase scene({.camera_count = 8});
  scene.AddImages(0, 8);
  const ReconstructionId into = scene.AddReconstruction({0, 1, 2, 3});
  const ReconstructionId from = scene.AddReconstruction({5, 6}, AnotherFrame());
  SceneWork work(&scene);
  const auto placement =
      PlacePhoto(work.context, *scene.Photo(4), scene.MatchesOf(4, {0, 1, 2, 3, 5, 6}), {}, 1);
  ASSERT_OK(placement);
  ASSERT_EQ(placement->merges.size(), 1u);
  const uint64_t version = scene.Snap()->GetReconstruction(into)->geometry_version;
  Commit(&scene, work.map, *placement);
  const auto snapshot = scene.Snap();
  const ReconstructionRecord kept = *snapshot->GetReconstruction(into),
                             gone = *snapshot->GetReconstruction(from);
  EXPECT_EQ(kept.image_count, 7u);
  EXPECT_EQ(kept.images_at_adjustment, 0u) << "the whole is due";
  EXPECT_GT(kept.geometry_version, version);
  EXPECT_EQ(gone.merged_into, into);
  EXPECT_EQ(gone.image_count, 0u);
  EXPECT_EQ(gone.point_count, 0u);
  EXPECT_NEAR(gone.merged_from_this.scale, 2, 2e-3);
  ExpectTrueCounts(*snapshot, into);
  ExpectSound(*snapshot);
}

// Whether an adjustment of the whole is due after a photo has merged two images into so many.
bool IsDueAfterMergeInto(uint32_t image_count) {
  SceneDatabase scene({.camera_count = image_count + 3, .point_count = 60});
  scene.AddImages(0, image_count + 3);
  std::vector<uint32_t> cameras(image_count), near;
  std::iota(cameras.begin(), cameras.end(), 0u);
  const ReconstructionId into = scene.AddReconstruction(cameras);
  scene.AddReconstruction({image_count + 1, image_count + 2}, AnotherFrame());
  for (uint32_t k = image_count - 4; k < image_count + 3; ++k) {
    if (k != image_count) near.push_back(k);
  }
  SceneWork work(&scene);
  const auto placement = PlacePhoto(work.context, *scene.Photo(image_count),
                                    scene.MatchesOf(image_count, near), {}, 1);
  EXPECT_OK(placement);
  EXPECT_EQ(placement->merges.size(), 1u);
  EXPECT_EQ(placement->reconstruction, into);
  Commit(&scene, work.map, *placement);
  ExpectSound(*scene.Snap());
  const ReconstructionRecord record = *scene.Snap()->GetReconstruction(into);
  EXPECT_EQ(record.image_count, image_count + 3);
  EXPECT_TRUE(record.images_at_adjustment == 0 || record.images_at_adjustment == image_count);
  return record.images_at_adjustment == 0;
}

TEST(ChangeWriter, AMuchSmallerPartDoesNotMakeTheWholeDue) {
  EXPECT_TRUE(IsDueAfterMergeInto(38)) << "39 with the photo";
  EXPECT_FALSE(IsDueAfterMergeInto(42)) << "43 with the photo";
}

TEST(ChangeWriter, WritesAnAdjustmentAsANewGeneration) {
  SceneDatabase scene;
  scene.AddImages(0, 5);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4});
  SceneWork work(&scene);
  ASSERT_OK(AdjustReconstruction(work.context, id));
  const ReconstructionRecord before = *scene.Snap()->GetReconstruction(id);
  const DatabaseState state = scene.State();
  const auto transaction = scene.database()->BeginTransaction();
  ReconstructionRecord after = before;
  ++after.points_generation;
  ASSERT_OK(WriteWhole(work.map, scene.database(), transaction.get(), &after));
  transaction->DeletePointBlocks(id, before.points_generation);
  WritePosesAndObservations(work.map, transaction.get());
  EXPECT_EQ(after.images_at_adjustment, 5u);
  ExpectTrueCounts(*scene.Snap(), id);  // not committed: all is as before
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
  ExpectTrueCounts(*scene.Snap(), id);
  ExpectSound(*scene.Snap());
  const auto old = scene.Snap()->GetPointBlock(id, before.points_generation, ImageId(1));
  ASSERT_OK(old);
  EXPECT_TRUE(old->points.empty()) << "the old generation is deleted";
}

}  // namespace
}  // namespace veduta
