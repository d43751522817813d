// SPDX-License-Identifier: Apache-2.0
// Goal: a pass on another grid leaves one whole surface at every instant, the old one or the new
//   one, and ends in the bytes of a pass that never knew the old grid; a grid on which there can be
//   no surface is refused before anything is written.
// Method: photos of a rendered street, small depth maps. The pass on another grid is stopped before
//   its first piece, then before its second and so on until it ends; after each stop the surface
//   that readers see is loaded tile by tile and compared with the two.
#include "fusion/pass/staged_surface.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "fusion/pass/dense_invariants.h"
#include "fusion/pass/dense_pass.h"
#include "fusion/pass/tile_parts.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

DensifyOptions SmallOptions() {
  DensifyOptions options;
  options.depth_side_px = 96;
  return options;
}

class StagedSurfaceTest : public testing::Test {
 protected:
  void SetUp() override {
    std::vector<Stand> stands;
    for (const double along_m : {20.0, 20.7, 21.4, 22.1, 22.8}) stands.push_back({along_m, 90});
    city_.Add(stands);
    const auto records = city_.Ask().snapshot().ListReconstructions();
    ASSERT_OK(records);
    id_ = records->front().id;
    const auto first = TryPass(SmallOptions());
    ASSERT_OK(first);
    voxel_size_ = first->voxel_size;
    ASSERT_GT(first->triangles, 100u);
  }

  Result<DensifyReport> TryPass(const DensifyOptions& options, DenseProgress progress = {},
                                std::stop_token stop = {}) {
    return RunDensePass(
        {*city_.parts().writer, *city_.parts().pool, nullptr, std::move(progress), stop}, id_,
        options);
  }

  // Stops before the n-th piece.
  Status StoppedAt(size_t n, const DensifyOptions& options) {
    std::stop_source stop;
    size_t told = 0;
    const DenseProgress count = [&](std::string_view, size_t, size_t) {
      if (++told == n) stop.request_stop();
    };
    return TryPass(options, count, stop.get_token()).status();
  }

  DensifyOptions Coarse() const {
    DensifyOptions options;
    options.voxel_size = 1.6 * voxel_size_;
    return options;
  }

  // Triangles of the surface that readers see, with each of its tiles loaded.
  uint64_t Triangles() const {
    const auto snapshot = city_.parts().database->GetSnapshot();
    const auto tiles = LoadCurrentTiles(*snapshot, id_);
    EXPECT_OK(tiles);
    uint64_t triangles = 0;
    for (const auto& [place, tile] : *tiles) {
      triangles += tile.triangle_count;
      if (tile.mesh_version == 0) continue;
      EXPECT_OK(LoadSurface(*snapshot, tile));
    }
    return triangles;
  }

  void ExpectSound() const {
    const auto violations = FindDenseViolations(*city_.parts().database->GetSnapshot(), 10);
    ASSERT_OK(violations);
    for (const std::string& violation : *violations) ADD_FAILURE() << violation;
  }

  City city_;
  ReconstructionId id_;
  double voxel_size_ = 0;
};

TEST_F(StagedSurfaceTest, OneWholeSurfaceAtEveryInstant) {
  const uint64_t old = Triangles();
  std::vector<uint64_t> seen;
  size_t stops = 0, moving = 0;
  bool moves = false;
  Status status = Status::Cancelled("not begun");
  while (status.code() == StatusCode::kCancelled) {
    ASSERT_LT(++stops, 1000u);
    // What was begun goes on, also where it is not asked for again.
    status = StoppedAt(moves ? 2 : stops, stops == 1 ? Coarse() : DensifyOptions());
    seen.push_back(Triangles());
    ExpectSound();
    moves = *IsMoving(*city_.parts().database->GetSnapshot(), id_);
    moving += moves;
  }
  ASSERT_OK(status);
  const uint64_t made = seen.back();
  EXPECT_LT(made, old);
  EXPECT_GT(stops, 30u);
  EXPECT_GT(moving, 2u) << "stopped while tiles move, too";
  for (const uint64_t triangles : seen) EXPECT_TRUE(triangles == old || triangles == made);
  EXPECT_TRUE(std::ranges::is_sorted(seen, std::greater())) << "the old one, then the new one";
  const std::string staged = city_.Digest();

  const auto transaction = city_.parts().database->BeginTransaction();
  transaction->dense().DeleteReconstruction(id_);
  ASSERT_OK(transaction->Commit());
  DensifyOptions fresh = SmallOptions();
  fresh.voxel_size = Coarse().voxel_size;
  ASSERT_OK(TryPass(fresh));
  EXPECT_EQ(city_.Digest(), staged) << "a pass on the new grid alone";
}

TEST_F(StagedSurfaceTest, ADamagedTileIsMadeAgainWhereTilesMove) {
  Database& database = *city_.parts().database;
  const auto moves = [&] { return *IsMoving(*database.GetSnapshot(), id_); };
  size_t stops = 0;
  Status status = StoppedAt(30, Coarse());
  while (status.code() == StatusCode::kCancelled && !moves()) {
    ASSERT_LT(++stops, 100u);
    status = StoppedAt(30 + stops, DensifyOptions());
  }
  ASSERT_TRUE(moves()) << status.message();
  const ReconstructionId staged = StagedSurfaceOf(id_);
  const auto tiles = LoadTileRecords(*database.GetSnapshot(), staged);
  ASSERT_OK(tiles);
  const auto victim =
      std::ranges::find_if(*tiles, [](const auto& entry) { return entry.second.blocks != 0; });
  ASSERT_NE(victim, tiles->end());
  const uint64_t tiles_before = LoadCurrentTiles(*database.GetSnapshot(), id_)->size();
  const auto transaction = database.BeginTransaction();
  const auto block = static_cast<uint8_t>(std::countr_zero(victim->second.blocks));
  transaction->dense().DeleteVolumeBlock(staged, victim->first, block);
  ASSERT_OK(transaction->Commit());
  ASSERT_OK(TryPass(DensifyOptions()));
  EXPECT_FALSE(moves());
  EXPECT_EQ(LoadCurrentTiles(*database.GetSnapshot(), id_)->size(), tiles_before);
  ExpectSound();
}

TEST_F(StagedSurfaceTest, TheFormerGridCanBeAskedForAgain) {
  const std::string before = city_.Digest();
  EXPECT_EQ(StoppedAt(25, Coarse()).code(), StatusCode::kCancelled);
  DensifyOptions former;
  former.voxel_size = voxel_size_;
  ASSERT_OK(TryPass(former));
  EXPECT_EQ(city_.Digest(), before);
}

TEST_F(StagedSurfaceTest, StagedTilesOfWhatWasMergedAwayGo) {
  EXPECT_EQ(StoppedAt(25, Coarse()).code(), StatusCode::kCancelled);
  Database& database = *city_.parts().database;
  auto record = database.GetSnapshot()->GetReconstruction(id_);
  ASSERT_OK(record);
  record->merged_into = ReconstructionId(99);
  const auto transaction = database.BeginTransaction();
  transaction->PutReconstruction(*record);
  ASSERT_OK(transaction->Commit());
  const auto swept = SweepMerged(*city_.parts().writer);
  ASSERT_OK(swept);
  EXPECT_EQ(*swept, 1u);
  size_t left = 0;
  ASSERT_OK(database.GetSnapshot()->dense().ScanAll([&](uint8_t, auto, auto) { ++left; }));
  EXPECT_EQ(left, 0u);
}

TEST_F(StagedSurfaceTest, RefusesGridsWithoutASurface) {
  const std::string before = city_.Digest();
  for (const double wrong :
       {1e-12, 1e-300, 1e300, 1e6, -1.0, 0.0, std::numeric_limits<double>::quiet_NaN(),
        std::numeric_limits<double>::infinity()}) {
    DensifyOptions options;
    options.voxel_size = wrong;
    const Status status = TryPass(options).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << wrong;
    EXPECT_EQ(city_.Digest(), before) << wrong;
  }
  DensifyOptions options;
  options.voxel_size = 1e-12;
  const std::string small = TryPass(options).status().message();
  for (const char* part : {"1e-12", "too small", "wide", "blocks", "--voxel a size from"})
    EXPECT_NE(small.find(part), std::string::npos) << small;
  options.voxel_size = 1e300;
  EXPECT_NE(TryPass(options).status().message().find("1e+300 is too large"), std::string::npos);
}

}  // namespace
}  // namespace veduta
