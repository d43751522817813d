// SPDX-License-Identifier: Apache-2.0
// Goal: the neighbours without a pose of a photo that gets one are tried again, once each; of those
//   with many placed neighbours only some times; and all where reconstructions are merged.
// Method: a synthetic scene in a database, where every image is a neighbour of every other.
#include "engine/ingest/retries.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

constexpr uint32_t kImages = 22;

// A scene whose first images have a pose, as many as are asked for.
class PartlyPlaced {
 public:
  explicit PartlyPlaced(uint32_t placed) : scene_({.camera_count = kImages}), placed_(placed) {
    scene_.AddImages(0, kImages);
    scene_.AddReconstruction(First(placed));
  }

  // Those that are tried again when the next `count` images get a pose.
  std::vector<ImageId> RetriesAfter(uint32_t count, std::vector<Merge> merges = {},
                                    std::vector<ImageId> waiting = {}) const {
    const CityMap map = scene_.MapOf(First(placed_ + count), ReconstructionId(1));
    Placement placement;
    for (uint32_t i = 0; i < count; ++i) placement.placed.emplace_back(placed_ + i + 1);
    placement.merges = std::move(merges);
    DatabaseState state;
    state.pending_propagation = std::move(waiting);
    EXPECT_OK(AppendRetries(map, *scene_.Snap(), placement, {}, &state));
    return state.pending_propagation;
  }

  // Those without a pose once `placed` have one.
  static std::vector<ImageId> Others(uint32_t placed) {
    std::vector<ImageId> ids;
    for (uint32_t id = placed + 1; id <= kImages; ++id) ids.emplace_back(id);
    return ids;
  }

 private:
  static std::vector<uint32_t> First(uint32_t count) {
    std::vector<uint32_t> cameras(count);
    std::iota(cameras.begin(), cameras.end(), 0);
    return cameras;
  }

  SceneDatabase scene_;
  const uint32_t placed_;
};

TEST(Retries, TheFirstFewNeighborsEachCountThenAQuarterMore) {
  std::vector<uint32_t> tried_at;
  for (uint32_t count = 1; count <= 30; ++count) {
    if (IsWorthAnother(count - 1, count)) tried_at.push_back(count);
  }
  EXPECT_EQ(tried_at,
            (std::vector<uint32_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 20, 25}));
  EXPECT_TRUE(IsWorthAnother(18, 22)) << "20 lies between";
  EXPECT_FALSE(IsWorthAnother(20, 24));
  EXPECT_FALSE(IsWorthAnother(5, 5));
}

TEST(Retries, BesideFewPlacedNeighborsAllAreTriedOnce) {
  const PartlyPlaced scene(4);
  EXPECT_EQ(scene.RetriesAfter(1), scene.Others(5));
  EXPECT_EQ(scene.RetriesAfter(1, {}, scene.Others(5)), scene.Others(5)) << "they wait already";
  EXPECT_TRUE(scene.RetriesAfter(0).empty()) << "nothing was placed";
}

TEST(Retries, BesideManyOnlyAsTheyGrow) {
  const PartlyPlaced scene(18);
  EXPECT_TRUE(scene.RetriesAfter(1).empty());
  EXPECT_EQ(scene.RetriesAfter(2), scene.Others(20));
}

TEST(Retries, AMergeHasAllTriedAgain) {
  const PartlyPlaced scene(18);
  Merge merge;
  merge.from = ReconstructionId(2);
  EXPECT_EQ(scene.RetriesAfter(1, {merge}), scene.Others(19));
}

TEST(Retries, PairsThatAreNotStoredYetCount) {
  SceneDatabase scene({.camera_count = 4});
  scene.AddImages(0, 3);
  const CityMap map = scene.MapOf({0, 1, 3}, ReconstructionId(1));
  Placement placement;
  placement.placed = {ImageId(4)};  // the photo at hand
  DatabaseState state;
  const ImageId neighbors[] = {ImageId(1), ImageId(3)};
  ASSERT_OK(AppendRetries(map, *scene.Snap(), placement, neighbors, &state));
  EXPECT_EQ(state.pending_propagation, std::vector{ImageId(3)}) << "the other one has a pose";
}

}  // namespace
}  // namespace veduta
