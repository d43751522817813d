// SPDX-License-Identifier: Apache-2.0
// Goal: the loader brings in what it is asked for and what belongs to it, exactly as it is stored,
//   records no change, and names an image whose records contradict each other.
// Method: a synthetic scene written to a database in a temporary folder; the map is compared with
//   the one that was written.
#include "engine/ingest/map_loader.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

void ExpectSamePoints(const CityMap& loaded, const CityMap& written, ImageId image) {
  const std::vector<PointId>& points = written.image(image).points;
  ASSERT_EQ(loaded.image(image).points, points);
  for (const PointId id : points) {
    if (!id.valid()) continue;
    ASSERT_NE(loaded.FindPoint(id), nullptr);
    EXPECT_EQ(loaded.point(id).track, written.point(id).track);
    EXPECT_EQ(loaded.point(id).position, written.point(id).position);
  }
}

TEST(MapLoader, LoadsWhatIsAskedForAndNoMore) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4});
  const CityMap written = scene.MapOf({0, 1, 2, 3, 4}, id);
  SceneWork work(&scene);
  const ImageId images[] = {ImageId(2), ImageId(6)};
  ASSERT_OK(work.loader.LoadImages(images));
  EXPECT_TRUE(work.map.HasImage(ImageId(2)));
  EXPECT_FALSE(work.map.HasImage(ImageId(6))) << "it has no pose";
  EXPECT_EQ(work.map.image(ImageId(2)).cam_from_world.translation,
            scene.scene().poses[1].translation);
  EXPECT_TRUE(work.map.PointsSeenBy({images, 1}).empty()) << "no block is loaded yet";

  ASSERT_OK(work.loader.LoadStructure(images));
  ExpectSamePoints(work.map, written, ImageId(2));
  EXPECT_EQ(work.map.images().size(), 1u);

  ASSERT_OK(work.loader.LoadNeighborhood(images));
  EXPECT_EQ(work.map.images().size(), 5u) << "every image shares a track with image 2";
  EXPECT_TRUE(work.map.changes().poses.empty());
  EXPECT_TRUE(work.map.changes().blocks.empty());
  EXPECT_TRUE(work.map.changes().counts.empty());
}

TEST(MapLoader, AnImageThatHasLostItsPoseInTheMapIsNotLoadedAgain) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3});
  SceneWork work(&scene);
  std::vector<ImageId> images;
  ASSERT_OK(work.loader.LoadReconstruction(id, &images));
  work.map.UnplaceImage(ImageId(2));
  ASSERT_OK(work.loader.LoadNeighborhood(images));
  EXPECT_FALSE(work.map.HasImage(ImageId(2)));
  work.map.Clear();
  ASSERT_OK(work.loader.LoadReconstruction(id, &images));
  EXPECT_TRUE(work.map.HasImage(ImageId(2))) << "it is as it is stored";
}

TEST(MapLoader, NamesWhatContradictsItself) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3});
  const ImageId images[] = {ImageId(2)};
  const auto fails = [&](const auto& damage, const std::string& words) {
    const auto transaction = scene.database()->BeginTransaction();
    damage(transaction.get());
    ASSERT_OK(transaction->Commit());
    const Status status = SceneWork(&scene).loader.LoadNeighborhood(images);
    EXPECT_EQ(status.code(), StatusCode::kCorruption) << words;
    EXPECT_NE(status.message().find(words), std::string::npos) << status.message();
  };
  const std::vector<Observation> seen = *scene.Snap()->GetObservations(ImageId(3));
  fails(
      [&](Transaction* t) {
        t->PutObservations(ImageId(3), {seen.data(), seen.size() - 1});
      },
      "is seen in image 3, which says no such thing");
  const auto mended = scene.database()->BeginTransaction();
  mended->PutObservations(ImageId(3), seen);
  ASSERT_OK(mended->Commit());
  PointBlock block = *scene.Snap()->GetPointBlock(id, 1, ImageId(1));
  block.next_ordinal = 1u << 31;
  fails([&](Transaction* t) { t->PutPointBlock(id, 1, block); }, "gives its next point number");
}

TEST(MapLoader, APairsMatchesNameFeaturesThatThereAre) {
  SceneDatabase scene;
  scene.AddImages(0, 2);
  PairRecord pair = *scene.Snap()->GetPair(ImageId(1), ImageId(2));
  EXPECT_OK(SceneWork(&scene).loader.GetPair(ImageId(1), ImageId(2)));
  pair.matches.back().b = 1'000'000;
  const auto transaction = scene.database()->BeginTransaction();
  transaction->PutPair(pair);
  ASSERT_OK(transaction->Commit());
  EXPECT_EQ(SceneWork(&scene).loader.GetPair(ImageId(1), ImageId(2)).status().code(),
            StatusCode::kCorruption);
}

TEST(MapLoader, LoadsAWholeReconstruction) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  const ReconstructionId first = scene.AddReconstruction({0, 1, 2});
  const ReconstructionId second = scene.AddReconstruction({3, 4, 5}, AnotherFrame());
  const CityMap written = scene.MapOf({3, 4, 5}, second, AnotherFrame());
  SceneWork work(&scene);
  std::vector<ImageId> members = {ImageId(99)};
  ASSERT_OK(work.loader.LoadReconstruction(second, &members));
  EXPECT_EQ(members, (std::vector{ImageId(4), ImageId(5), ImageId(6)}));
  for (const ImageId id : members) ExpectSamePoints(work.map, written, id);
  EXPECT_FALSE(work.map.HasImage(ImageId(1)));
  const auto record = work.loader.GetReconstruction(first);
  ASSERT_OK(record);
  EXPECT_EQ(record->image_count, 3u);
  EXPECT_EQ(work.loader.GetReconstruction(ReconstructionId(9)).status().code(),
            StatusCode::kNotFound);
}

TEST(MapLoader, ContradictingRecordsAreCorruption) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  scene.AddReconstruction({0, 1, 2});
  const auto transaction = scene.database()->BeginTransaction();
  const Observation beyond = {1'000'000, {ImageId(1), 1}};
  transaction->PutObservations(ImageId(2), {&beyond, 1});
  ASSERT_OK(transaction->Commit());
  SceneWork work(&scene);
  const ImageId images[] = {ImageId(2)};
  const Status status = work.loader.LoadImages(images);
  EXPECT_EQ(status.code(), StatusCode::kCorruption);
  EXPECT_NE(status.message().find("image 2"), std::string::npos) << status.message();
}

}  // namespace
}  // namespace veduta
