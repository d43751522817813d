// SPDX-License-Identifier: Apache-2.0
// Goal: a removed photo is gone with its points, and the rest is a sound map: points keep their
//   other views under a home that is there, images that stood on it wait, a reconstruction of two
//   is dissolved, and the adjustment that is due goes through.
// Method: a synthetic scene in a database; after each removal all invariants are checked, and
//   points are compared with those of a map that never had the image.
#include "engine/ingest/photo_removal.h"

#include <gtest/gtest.h>

#include "engine/ingest/dense_removal.h"
#include "engine/ingest/ingest.h"
#include "engine/ingest/local_unplacing.h"
#include "tests/engine/ingest/scene_database.h"
#include "tests/engine/ingest/torn_scene.h"

namespace veduta {
namespace {

class Remover {
 public:
  explicit Remover(SceneDatabase* scene)
      : scene_(*scene),
        retrieval_({}),
        ingest_(scene->database(), &retrieval_, scene->features(), scene->pool(), {}) {}

  RemovedPhoto Remove(uint32_t id) {
    Result<RemovedPhoto> removed = ingest_.Remove(ImageId(id), "bea", "my door");
    EXPECT_OK(removed);
    ExpectSound();
    return removed.ok() ? *removed : RemovedPhoto();
  }
  void Settle() {
    while (const auto step = ingest_.RunNextStep()) EXPECT_OK(step->status);
    ExpectSound();
  }
  void ExpectSound() const {
    const auto violations = FindViolations(*scene_.Snap(), 5);
    ASSERT_OK(violations);
    for (const std::string& violation : *violations) ADD_FAILURE() << violation;
  }
  Ingest& ingest() { return ingest_; }

 private:
  SceneDatabase& scene_;
  Retrieval retrieval_;
  Ingest ingest_;
};

std::vector<PointRecord> PointsOf(const Snapshot& snapshot, ReconstructionId id) {
  std::vector<PointRecord> points;
  const ReconstructionRecord record = *snapshot.GetReconstruction(id);
  EXPECT_OK(snapshot.ScanPointBlocks(id, record.points_generation, [&](const PointBlock& block) {
    points.insert(points.end(), block.points.begin(), block.points.end());
    return true;
  }));
  return points;
}

// By where they are: names differ.
std::map<std::array<double, 3>, std::vector<TrackElement>> ByPlace(
    const std::vector<PointRecord>& points) {
  std::map<std::array<double, 3>, std::vector<TrackElement>> placed;
  for (const PointRecord& p : points)
    placed[{p.position.x(), p.position.y(), p.position.z()}] = p.track;
  return placed;
}

TEST(PhotoRemoval, OthersKeepTheirPointsUnderOtherHomes) {
  SceneDatabase scene, without;
  for (SceneDatabase* one : {&scene, &without}) one->AddImages(0, 5);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4});
  ASSERT_EQ(without.AddReconstruction({1, 2, 3, 4}), id);
  const size_t seen = scene.Snap()->GetObservations(ImageId(1))->size();
  ASSERT_GT(seen, 0u);
  Remover remover(&scene);
  const RemovedPhoto removed = remover.Remove(1);  // it is home to most points
  EXPECT_EQ(removed.name, "image0");
  EXPECT_EQ(removed.reconstruction, id);
  EXPECT_EQ(removed.observations, seen);
  EXPECT_TRUE(removed.unplaced.empty());
  EXPECT_FALSE(removed.was_dense);
  const auto snapshot = scene.Snap();
  EXPECT_EQ(ByPlace(PointsOf(*snapshot, id)), ByPlace(PointsOf(*without.Snap(), id)));
  EXPECT_EQ(snapshot->GetReconstruction(id)->image_count, 4u);
  EXPECT_EQ(snapshot->GetReconstruction(id)->images_at_adjustment, 0u) << "it is due";
  EXPECT_EQ(snapshot->GetImage(ImageId(1)).status().code(), StatusCode::kNotFound);
  EXPECT_FALSE((*snapshot->FindPose(ImageId(1))).has_value());
  EXPECT_TRUE(snapshot->GetState()->removed_bytes_left);
  remover.Settle();
}

TEST(PhotoRemoval, OneAfterAnotherUntilTheReconstructionIsDissolved) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3});
  Remover remover(&scene);
  EXPECT_TRUE(remover.Remove(2).unplaced.empty());
  const RemovedPhoto last = remover.Remove(4);  // two would be left
  EXPECT_EQ(last.unplaced, (std::vector{ImageId(1), ImageId(3)}));
  const auto snapshot = scene.Snap();
  EXPECT_TRUE(snapshot->GetReconstruction(id)->is_dissolved);
  EXPECT_TRUE(PointsOf(*snapshot, id).empty());
  for (const ImageId other : last.unplaced) {
    EXPECT_EQ(snapshot->GetImage(other)->verdict, Verdict::kPostponed);
    EXPECT_FALSE((*snapshot->FindPose(other)).has_value());
  }
  EXPECT_EQ(snapshot->GetState()->pending_propagation, last.unplaced);
  remover.Settle();
  EXPECT_TRUE(scene.Snap()->GetState()->pending_propagation.empty());
}

TEST(PhotoRemoval, ImagesThatSeeTooLittleWithoutItWait) {
  SceneDatabase scene;
  scene.AddImages(0, 5);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4});
  const auto snapshot = scene.Snap();
  // Image 3 sees fewer points than it needs; that is noticed when one of them changes.
  const auto transaction = scene.database()->BeginTransaction();
  CityMap map;
  MapLoader loader(snapshot, scene.features(), &map);
  std::vector<ImageId> members;
  ASSERT_OK(loader.LoadReconstruction(id, &members));
  const std::vector<PointId> seen_by_5 = map.PointsSeenBy(std::vector{ImageId(5)});
  uint32_t left = 0;
  for (const PointId point : map.PointsSeenBy(std::vector{ImageId(3)})) {
    const bool is_shared = std::ranges::binary_search(seen_by_5, point);
    if (is_shared && ++left <= 15) continue;
    map.RemoveObservation(point, ImageId(3));
  }
  ASSERT_GE(left, 15u);
  ReconstructionRecord record = *snapshot->GetReconstruction(id);
  const CountChange& change = map.changes().counts.at(id);
  record.point_count += change.points;
  record.observation_count += change.observations;
  record.reprojection_error_px_sum += change.reprojection_error_px_sum;
  WritePosesAndObservations(map, transaction.get());
  for (const ImageId home : map.changes().blocks)
    transaction->PutPointBlock(id, record.points_generation, map.StoredBlock(home));
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  Remover remover(&scene);
  const RemovedPhoto removed = remover.Remove(5);
  EXPECT_EQ(removed.unplaced, std::vector{ImageId(3)});
  EXPECT_EQ(scene.Snap()->GetImage(ImageId(3))->reason, Reason::kDoubted);
  EXPECT_EQ(scene.Snap()->GetReconstruction(id)->image_count, 3u);
  remover.Settle();
  EXPECT_TRUE((*scene.Snap()->FindPose(ImageId(3))).has_value())
      << "it is tried again by its pairs";
}

TEST(PhotoRemoval, APhotoWithoutPoseGoesWithoutTouchingTheMap) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2});
  const ReconstructionRecord before = *scene.Snap()->GetReconstruction(id);
  Remover remover(&scene);
  const RemovedPhoto removed = remover.Remove(4);
  EXPECT_FALSE(removed.reconstruction.valid());
  EXPECT_EQ(removed.observations, 0u);
  EXPECT_EQ(scene.Snap()->GetReconstruction(id)->geometry_version, before.geometry_version);
  EXPECT_EQ(scene.State().retrievable_image_count, 3u);
}

TEST(PhotoRemoval, OfAnUnknownImageChangesNothing) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  Remover remover(&scene);
  const uint64_t before = scene.Snap()->sequence();
  EXPECT_EQ(remover.ingest().Remove(ImageId(9), "bea", "").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(scene.Snap()->sequence(), before);
}

TEST(LocalUnplacing, PostponedImagesWaitOnce) {
  SceneDatabase scene;
  scene.AddImages(0, 2);
  DatabaseState state = scene.State();
  state.pending_propagation = {ImageId(2)};
  const auto transaction = scene.database()->BeginTransaction();
  ASSERT_OK(PostponeImages(*scene.Snap(), std::vector{ImageId(1), ImageId(2)}, {}, "why", &state,
                           transaction.get()));
  EXPECT_EQ(state.pending_propagation, (std::vector{ImageId(2), ImageId(1)}));
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
  EXPECT_EQ(scene.Snap()->GetImage(ImageId(1))->detail, "why");
}

// Writes something that contradicts another record, and returns the first violation.
template <typename Write>
std::string ViolationAfter(SceneDatabase* scene, const Write& write) {
  DatabaseState state = scene->State();
  const auto transaction = scene->database()->BeginTransaction();
  write(transaction.get(), &state);
  transaction->PutState(state);
  EXPECT_OK(transaction->Commit());
  const auto violations = FindViolations(*scene->Snap(), 9);
  EXPECT_OK(violations);
  return violations.ok() && !violations->empty() ? violations->front() : "";
}

TEST(RemovalChecks, NoticeWhatContradictsTheJournal) {
  {
    SceneDatabase scene;
    scene.AddImages(0, 3);
    EXPECT_NE(ViolationAfter(&scene,
                             [](Transaction* transaction, DatabaseState* state) {
                               transaction->RemoveImage(ImageId(2));
                               --state->retrievable_image_count;
                             }),
              "")
        << "image 2 is gone, and the journal does not say so";
  }
  SceneDatabase scene;
  scene.AddImages(0, 3);
  const std::string still_there =
      ViolationAfter(&scene, [](Transaction* transaction, DatabaseState* state) {
        AppendJournal({0, 0, "bea", "remove", ImageId(2), {}, ""}, state, transaction);
      });
  EXPECT_NE(still_there.find("removed"), std::string::npos) << still_there;
}

TEST(RemovalChecks, NoticeWhatContradictsAStatement) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  const std::string stored = ViolationAfter(&scene, [](Transaction* transaction, DatabaseState*) {
    transaction->PutForbidden({ForbiddenKind::kPair, 1, 2, 0, "bea", ""});
  });
  EXPECT_NE(stored.find("forbidden"), std::string::npos) << stored;
  const std::string no_image = ViolationAfter(&scene, [](Transaction* transaction, DatabaseState*) {
    transaction->DeleteForbidden(ForbiddenKind::kPair, 1, 2);
    transaction->PutForbidden({ForbiddenKind::kPair, 1, 9, 0, "bea", ""});
  });
  EXPECT_NE(no_image.find("does not exist"), std::string::npos) << no_image;
  const std::string no_merge = ViolationAfter(&scene, [](Transaction* transaction, DatabaseState*) {
    transaction->DeleteForbidden(ForbiddenKind::kPair, 1, 9);
    transaction->PutForbidden({ForbiddenKind::kMerge, 1, 2, 0, "bea", ""});
  });
  EXPECT_NE(no_merge.find("do not exist"), std::string::npos) << no_merge;
}

DepthRecord DepthOf(uint32_t image, std::vector<uint32_t> sensors, uint64_t checked) {
  DepthRecord depth;
  depth.image = ImageId(image);
  depth.reconstruction = ReconstructionId(1);
  depth.version = 100 + image;
  depth.width_px = depth.height_px = 1;
  depth.fx = depth.fy = depth.depth_near = 1;
  depth.depth_far = 2;
  for (const uint32_t sensor : sensors) depth.sensors.push_back({ImageId(sensor), {}});
  depth.checked_version = checked;
  return depth;
}

CheckedDepthRecord CheckedOf(uint32_t image, uint64_t version, std::vector<uint32_t> neighbors) {
  CheckedDepthRecord depth;
  depth.image = ImageId(image);
  depth.reconstruction = ReconstructionId(1);
  depth.version = version;
  depth.width_px = depth.height_px = 1;
  depth.fx = depth.fy = depth.depth_near = 1;
  depth.depth_far = 2;
  for (const uint32_t neighbor : neighbors)
    depth.neighbors.push_back({ImageId(neighbor), 0, 100 + neighbor});
  return depth;
}

TEST(DenseRemoval, DeletesWhatWasMadeWithTheImagesAndNothingElse) {
  SceneDatabase scene;
  const DepthPixels pixels{{1}, {2}};
  auto transaction = scene.database()->BeginTransaction();
  DenseWriter& dense = transaction->dense();
  dense.PutSettings({ReconstructionId(1), 0.5, 512, 2});
  // Image 2 has image 1 for a sensor view, image 3 was checked against image 1, image 4 has nothing
  // to do with it.
  const std::vector<DepthRecord> depths = {DepthOf(1, {2}, 11), DepthOf(2, {1}, 12),
                                           DepthOf(3, {4}, 13), DepthOf(4, {3}, 14)};
  const std::vector<CheckedDepthRecord> checked = {CheckedOf(1, 11, {2}), CheckedOf(2, 12, {4}),
                                                   CheckedOf(3, 13, {1, 4}), CheckedOf(4, 14, {3})};
  for (const DepthRecord& depth : depths) {
    dense.PutDepth(depth);
    dense.PutDepthPixels(depth.image, pixels);
  }
  for (const CheckedDepthRecord& depth : checked) dense.PutCheckedDepth(depth, pixels);
  for (int32_t x = 1; x <= 4; ++x) {
    TileRecord tile;
    tile.reconstruction = ReconstructionId(1);
    tile.place = {x, 0, 0};
    tile.blocks = 1;
    tile.depths = {{ImageId(static_cast<uint32_t>(x)), 0, 10 + static_cast<uint64_t>(x)}};
    dense.PutTile(tile);
  }
  ASSERT_OK(transaction->Commit());
  transaction = scene.database()->BeginTransaction();
  const ImageId one[] = {ImageId(1)};
  EXPECT_TRUE(*RemoveFromDense(*scene.Snap(), one, transaction.get()));
  ASSERT_OK(transaction->Commit());
  const auto snapshot = scene.Snap();
  const DenseReader& left = snapshot->dense();
  EXPECT_FALSE((*left.FindDepth(ImageId(1))).has_value());
  EXPECT_FALSE((*left.FindDepth(ImageId(2))).has_value());
  EXPECT_EQ((*left.FindDepth(ImageId(3)))->checked_version, 0u);
  EXPECT_EQ((*left.FindDepth(ImageId(4)))->checked_version, 14u);
  EXPECT_FALSE(left.GetCheckedDepth(ImageId(3), 13).ok());
  EXPECT_OK(left.GetCheckedDepth(ImageId(4), 14));
  for (int32_t x = 1; x <= 4; ++x) {
    EXPECT_EQ((*left.FindTile(ReconstructionId(1), {x, 0, 0})).has_value(), x == 4) << x;
  }
  transaction = scene.database()->BeginTransaction();
  EXPECT_FALSE(*RemoveFromDense(*snapshot, one, transaction.get())) << "nothing is left of it";
}

TEST(DenseRemoval, WhatIsSplitOffLosesItsDepthMaps) {
  SceneDatabase scene(kTwoSides);
  const ReconstructionId id = AddTwoSides(&scene);
  ContradictSeam(&scene);
  const ImageId stays = SideImages(0)[0], goes = SideImages(1)[0];
  const auto transaction = scene.database()->BeginTransaction();
  for (const ImageId image : {stays, goes}) {
    transaction->dense().PutDepth(DepthOf(image.value, {}, 0));
    transaction->dense().PutDepthPixels(image, {{1}, {2}});
  }
  ReconstructionRecord record = *scene.Snap()->GetReconstruction(id);
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  Remover remover(&scene);
  const auto step = remover.ingest().RunNextStep();
  ASSERT_TRUE(step.has_value());
  EXPECT_OK(step->status);
  EXPECT_EQ(scene.Snap()->FindPose(goes).value()->reconstruction, ReconstructionId(2));
  EXPECT_TRUE((*scene.Snap()->dense().FindDepth(stays)).has_value());
  EXPECT_FALSE((*scene.Snap()->dense().FindDepth(goes)).has_value());
}

}  // namespace
}  // namespace veduta
