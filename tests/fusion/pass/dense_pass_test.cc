// SPDX-License-Identifier: Apache-2.0
// Goal: the dense pass makes anew what is stale and nothing else: depth maps that are withdrawn
//   and added leave the bytes of a pass from nothing; poses that hardly move keep what was made
//   from them; what was merged away goes; damage is named; photos may be added while it runs.
// Method: photos of a rendered street in a real database; small depth maps, C++ paths; the pass
//   run again after one change at a time, its report and its stored bytes compared.
#include "fusion/pass/dense_pass.h"

#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "fusion/pass/dense_invariants.h"
#include "fusion/pass/run_stages.h"
#include "fusion/pass/scene.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

constexpr uint32_t kSidePx = 96;

DensifyOptions SmallOptions() {
  DensifyOptions options;
  options.depth_side_px = kSidePx;
  return options;
}

// A database of six photos of one stretch of the street, filled once and copied for each test.
class DensePassTest : public testing::Test {
 protected:
  Database* database() const { return city_.parts().database.get(); }
  ThreadPool& pool() const { return *city_.parts().pool; }
  void SetUp() override {
    std::vector<Stand> stands;
    for (const double along_m : {20.0, 20.7, 21.4, 22.1, 22.8, 23.5})
      stands.push_back({along_m, 90});
    city_.Add(stands);
    const auto records = city_.Ask().snapshot().ListReconstructions();
    ASSERT_OK(records);
    ASSERT_EQ(records->size(), 1u);
    id_ = records->front().id;
    ASSERT_EQ(records->front().image_count, stands.size());
  }

  Result<DensifyReport> TryPass(const DensifyOptions& options, DenseProgress progress = {},
                                std::stop_token stop = {}) {
    return RunDensePass({writer_, pool(), /*device=*/nullptr, std::move(progress), stop}, id_,
                        options);
  }

  DensifyReport Pass(const DensifyOptions& options = SmallOptions()) {
    auto report = TryPass(options);
    EXPECT_OK(report);
    return report.ok() ? *report : DensifyReport();
  }

  // Keys and values of one family, hashed.
  std::vector<ContentHash> Stored(uint8_t wanted) {
    std::vector<ContentHash> hashes;
    EXPECT_OK(database()->GetSnapshot()->dense().ScanAll([&](uint8_t family, auto key, auto value) {
      if (family != wanted) return;
      hashes.push_back(HashContent(key));
      hashes.push_back(HashContent(value));
    }));
    return hashes;
  }

  void ExpectSound() {
    const auto violations = FindDenseViolations(*database()->GetSnapshot(), 10);
    ASSERT_OK(violations);
    for (const std::string& violation : *violations) ADD_FAILURE() << violation;
  }

  void MovePose(ImageId image, double distance) {
    auto pose = database()->GetSnapshot()->FindPose(image);
    ASSERT_OK(pose);
    (*pose)->cam_from_world.translation.x() += distance;
    const auto transaction = database()->BeginTransaction();
    transaction->PutPose(**pose);
    ASSERT_OK(transaction->Commit());
  }

  City city_;
  Writer& writer_ = *city_.parts().writer;
  ReconstructionId id_;
};

constexpr uint8_t kVolumeFamily = 19;  // Family::kVolume, which only storage/ may name

TEST_F(DensePassTest, WithdrawnAndAddedMapsLeaveTheBytesOfAPassFromNothing) {
  DensifyOptions few = SmallOptions();
  few.neighbor_count = 1;  // other checks, so other maps
  Pass(few);
  const std::vector<ContentHash> from_nothing = Stored(kVolumeFamily);
  ASSERT_GT(from_nothing.size(), 20u);
  // A tile that loses half of its maps or fewer has them withdrawn one by one.
  const DensifyReport grown = Pass();
  EXPECT_EQ(grown.depths.computed, 0u);
  EXPECT_GT(grown.volume.computed, 0u);
  EXPECT_FALSE(Stored(kVolumeFamily) == from_nothing);
  ExpectSound();
  const auto transaction = database()->BeginTransaction();
  transaction->dense().DeleteReconstruction(id_);
  ASSERT_OK(transaction->Commit());
  const std::vector<ContentHash> none = Stored(kVolumeFamily);
  EXPECT_TRUE(none.empty());
  Pass();
  const std::vector<ContentHash> again = Stored(kVolumeFamily);
  // One map moves: it alone is withdrawn and added, in tiles that hold others too.
  MovePose(ImageId(2), grown.voxel_size);
  const DensifyReport moved = Pass();
  EXPECT_GT(moved.volume.computed, 0u);
  const std::vector<ContentHash> changed = Stored(kVolumeFamily);
  EXPECT_FALSE(changed == again);
  const auto cleared = database()->BeginTransaction();
  cleared->dense().DeleteReconstruction(id_);
  ASSERT_OK(cleared->Commit());
  DensifyOptions same_grid = SmallOptions();
  same_grid.voxel_size = moved.voxel_size;
  Pass(same_grid);
  EXPECT_TRUE(Stored(kVolumeFamily) == changed) << "step by step as all at once";
}

TEST_F(DensePassTest, WhatHardlyMovesStays) {
  const DensifyReport first = Pass();
  ASSERT_EQ(first.depths.computed, 6u);
  MovePose(ImageId(3), 1e-5);
  const DensifyReport still = Pass();
  EXPECT_EQ(
      still.depths.computed + still.checks.computed + still.volume.computed + still.colors.computed,
      0u);
  MovePose(ImageId(3), 0.05);
  const DensifyReport moved = Pass();
  EXPECT_GE(moved.depths.computed, 1u);
  EXPECT_LT(moved.depths.computed, 6u) << "those that it is no sensor view of";
  EXPECT_GT(moved.volume.computed, 0u);
  ExpectSound();
}

TEST_F(DensePassTest, SettingsAreKeptAndChangeable) {
  const DensifyReport first = Pass();
  EXPECT_EQ(first.depth_side_px, kSidePx);
  EXPECT_EQ(first.sensor_count, 2u);
  DensifyOptions unset;
  const DensifyReport same = Pass(unset);
  EXPECT_EQ(same.depth_side_px, first.depth_side_px);
  EXPECT_EQ(same.sensor_count, first.sensor_count);
  EXPECT_EQ(same.voxel_size, first.voxel_size);
  EXPECT_EQ(same.depths.kept, 6u);
  unset.sensor_count = 3;
  const DensifyReport three = Pass(unset);
  EXPECT_EQ(three.sensor_count, 3u);
  EXPECT_GT(three.depths.computed, 0u);
  EXPECT_EQ(three.voxel_size, first.voxel_size);
  EXPECT_EQ(Pass().sensor_count, 3u);
}

TEST_F(DensePassTest, WhatWasMergedAwayGoes) {
  Pass();
  auto record = database()->GetSnapshot()->GetReconstruction(id_);
  ASSERT_OK(record);
  record->merged_into = ReconstructionId(99);
  const auto transaction = database()->BeginTransaction();
  transaction->PutReconstruction(*record);
  ASSERT_OK(transaction->Commit());
  const auto swept = SweepMerged(writer_);
  ASSERT_OK(swept);
  EXPECT_EQ(*swept, 1u);
  size_t left = 0;
  ASSERT_OK(database()->GetSnapshot()->dense().ScanAll([&](uint8_t, auto, auto) { ++left; }));
  EXPECT_EQ(left, 0u);
  const Status merged = TryPass(SmallOptions()).status();
  EXPECT_EQ(merged.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(merged.message().find("merged into 99"), std::string::npos) << merged.message();
}

TEST_F(DensePassTest, SweepsItsOwnSupersededMapsOnly) {
  Pass();
  const auto snapshot = database()->GetSnapshot();
  const auto depth = snapshot->dense().FindDepth(ImageId(1));
  ASSERT_TRUE(depth.ok() && *depth);
  auto checked = snapshot->dense().GetCheckedDepth(ImageId(1), (*depth)->checked_version);
  const auto pixels =
      snapshot->dense().GetCheckedDepthPixels(ImageId(1), (*depth)->checked_version);
  ASSERT_OK(checked);
  ASSERT_OK(pixels);
  const auto transaction = database()->BeginTransaction();
  checked->version = 1;
  transaction->dense().PutCheckedDepth(*checked, *pixels);
  checked->version = 2;
  checked->reconstruction =
      ReconstructionId(77);  // whose pass was killed before its tiles let go of the map
  transaction->dense().PutCheckedDepth(*checked, *pixels);
  ASSERT_OK(transaction->Commit());
  Pass();
  const auto later = database()->GetSnapshot();
  EXPECT_EQ(later->dense().GetCheckedDepth(ImageId(1), 1).status().code(), StatusCode::kNotFound);
  EXPECT_OK(later->dense().GetCheckedDepth(ImageId(1), 2));
  EXPECT_OK(later->dense().GetCheckedDepth(ImageId(1), (*depth)->checked_version));
}

TEST_F(DensePassTest, DamageIsNamed) {
  Pass();
  ExpectSound();
  const auto snapshot = database()->GetSnapshot();
  std::vector<TileRecord> tiles;
  ASSERT_OK(snapshot->dense().ScanTiles(id_, [&](const TileRecord& tile) {
    tiles.push_back(tile);
    return true;
  }));
  ASSERT_GT(tiles.size(), 3u);
  auto depth = snapshot->dense().FindDepth(ImageId(1));
  ASSERT_TRUE(depth.ok() && *depth);
  const std::vector<uint8_t> rubbish = {1, 2, 3};
  const auto transaction = database()->BeginTransaction();
  (*depth)->known_count += 1;
  transaction->dense().PutDepth(**depth);
  const uint8_t block = static_cast<uint8_t>(std::countr_zero(tiles[0].blocks));
  transaction->dense().PutVolumeBlock(id_, tiles[0].place, block, rubbish);
  transaction->dense().PutSurface(SurfacePart::kMesh, id_, tiles[1].place, rubbish);
  transaction->dense().DeleteCheckedDepth(
      ImageId(2), (*snapshot->dense().FindDepth(ImageId(2)))->checked_version);
  ASSERT_OK(transaction->Commit());
  const auto violations = FindDenseViolations(*database()->GetSnapshot(), 1000);
  ASSERT_OK(violations);
  const auto named = [&](const std::string& words) {
    return std::ranges::any_of(
        *violations, [&](const std::string& v) { return v.find(words) != std::string::npos; });
  };
  const auto name = [](const TileRecord& t) {
    return "tile " + std::to_string(t.place.x) + "," + std::to_string(t.place.y) + "," +
           std::to_string(t.place.z);
  };
  EXPECT_TRUE(named("depth map of image 1 has"));
  EXPECT_TRUE(named("depth map of image 2: there is no such"));
  EXPECT_TRUE(named(name(tiles[0])));
  EXPECT_TRUE(named(name(tiles[1])));
  EXPECT_EQ(FindDenseViolations(*database()->GetSnapshot(), 1)->size(), 1u)
      << "no more than asked for";
}

TEST_F(DensePassTest, StopsBetweenPiecesAndRefusesNonsense) {
  std::stop_source stop;
  DensifyOptions options = SmallOptions();
  const DenseProgress stop_soon = [&](std::string_view stage, size_t done, size_t) {
    if (stage == "depth maps" && done == 2) stop.request_stop();
  };
  const Status stopped = TryPass(options, stop_soon, stop.get_token()).status();
  EXPECT_EQ(stopped.code(), StatusCode::kCancelled);
  const DensifyReport rest = Pass();
  EXPECT_EQ(rest.depths.kept, 2u);
  EXPECT_EQ(rest.depths.computed, 4u);
  options = SmallOptions();
  options.neighbor_count = 0;
  EXPECT_EQ(TryPass(options).status().code(), StatusCode::kInvalidArgument);
  id_ = ReconstructionId(9);
  EXPECT_EQ(TryPass(SmallOptions()).status().code(), StatusCode::kNotFound);
}

// Asks to stop when the first photo is decoded: its depth map is begun then.
class StoppingDecoder final : public PhotoDecoder {
 public:
  explicit StoppingDecoder(std::stop_source* stop) : stop_(stop) {}
  PhotoExamination Examine(std::span<const uint8_t> bytes) const override {
    return DecoderInProcess().Examine(bytes);
  }
  Pixels DecodePixels(std::span<const uint8_t> bytes, const PhotoHeader& header) const override {
    stop_->request_stop();
    return DecoderInProcess().DecodePixels(bytes, header);
  }
  uint64_t HandoverBytes(uint64_t size_bytes, uint64_t pixel_count) const override {
    return DecoderInProcess().HandoverBytes(size_bytes, pixel_count);
  }

 private:
  std::stop_source* const stop_;
};

TEST_F(DensePassTest, AStopInTheMiddleOfADepthMapStoresNothingOfIt) {
  std::stop_source stop;
  const StoppingDecoder decoder(&stop);
  const auto stopped = RunDensePass(
      {writer_, pool(), /*device=*/nullptr, {}, stop.get_token(), decoder}, id_, SmallOptions());
  EXPECT_EQ(stopped.status().code(), StatusCode::kCancelled);
  ExpectSound();
  const DensifyReport rest = Pass();
  EXPECT_EQ(rest.depths.kept, 0u);
  EXPECT_EQ(rest.depths.computed, 6u);
}

TEST_F(DensePassTest, EveryStageNoticesItsOptions) {
  Pass();
  const auto settings = database()->GetSnapshot()->dense().FindSettings(id_);
  ASSERT_TRUE(settings.ok() && *settings);
  DenseStageOptions options = StageOptionsOf(SmallOptions(), **settings);
  const auto scene = LoadScene(*database()->GetSnapshot(), id_);
  ASSERT_OK(scene);
  const auto computed = [&] {
    const DensePassTools tools{writer_, pool(), nullptr, {}, {}};
    DensePass pass(tools, *scene);
    DensifyReport r;
    EXPECT_OK(RunStages(options, &pass, &r));
    return std::vector{r.depths.computed > 0,    r.checks.computed > 0, r.volume.computed > 0,
                       r.solutions.computed > 0, r.meshes.computed > 0, r.exposures.computed > 0,
                       r.colors.computed > 0};
  };
  EXPECT_EQ(computed(), std::vector(7, false)) << "nothing is stale yet";
  // From the last stage to the first: what a stage makes anew may leave nothing to do after it, but
  // nothing before it is made anew.
  const std::vector<std::pair<size_t, std::function<void()>>> changes = {
      {6, [&] { options.colors.coloring.outlier_deviations += 0.5; }},
      {5, [&] { options.exposures.exposure.observations_min += 1; }},
      {4, [&] { options.meshes.extraction.piece_extent_cells_min -= 1; }},
      {3, [&] { options.fusion.solver.lambda += 0.25; }},
      {2, [&] { options.volume.grid.truncation_voxels += 0.5; }},
      {1, [&] { options.checks.consistency.confidence_sure += 8; }},
      {0, [&] { options.depths.estimation.penalty_small += 1; }},
  };
  for (const auto& [stage, change] : changes) {
    change();
    const std::vector<bool> made = computed();
    EXPECT_TRUE(made[stage]) << "stage " << stage;
    for (size_t before = 0; before < stage; ++before)
      EXPECT_FALSE(made[before]) << "stage " << before << " before " << stage;
    EXPECT_EQ(computed(), std::vector(7, false)) << "after stage " << stage;
  }
  ExpectSound();
}

TEST_F(DensePassTest, AVolumeOfOtherOptionsIsMadeFromNothing) {
  Pass();
  const std::vector<ContentHash> first = Stored(kVolumeFamily);
  const auto settings = database()->GetSnapshot()->dense().FindSettings(id_);
  ASSERT_TRUE(settings.ok() && *settings);
  const auto scene = LoadScene(*database()->GetSnapshot(), id_);
  ASSERT_OK(scene);
  const DensePassTools tools{writer_, pool(), nullptr, {}, {}};
  DensePass pass(tools, *scene);
  DenseStageOptions options = StageOptionsOf(SmallOptions(), **settings);
  options.volume.grid.truncation_voxels = 5;
  ASSERT_OK(UpdateVolume(options.volume, options.allocation, &pass));
  EXPECT_FALSE(Stored(kVolumeFamily) == first) << "the same maps, but not the same votes";
  options.volume.grid.truncation_voxels = 4;
  ASSERT_OK(UpdateVolume(options.volume, options.allocation, &pass));
  EXPECT_TRUE(Stored(kVolumeFamily) == first);
}

TEST_F(DensePassTest, PhotosMayBeAddedWhileItRuns) {
  const std::vector<Stand> more = {{24.2, 90}, {24.9, 90}};
  for (const Stand& stand : more) TakePhoto(stand);  // rendered beforehand
  std::thread adding;
  const DenseProgress add_meanwhile = [&](std::string_view stage, size_t done, size_t) {
    if (stage == "depth maps" && done == 1) adding = std::thread([&] { city_.Add(more); });
    if (stage == "surface" && adding.joinable()) adding.join();  // before the pass ends
  };
  const auto during = TryPass(SmallOptions(), add_meanwhile);
  ASSERT_OK(during);
  EXPECT_FALSE(during->merged_into.valid());
  EXPECT_EQ(during->depths.computed, 6u) << "those that were there when it began";
  EXPECT_EQ(city_.Counts().placed, 8u);
  ExpectSound();
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
  const DensifyReport after = Pass();
  EXPECT_GE(after.depths.computed, 2u);
  ExpectSound();

  // Nobody can tell from the database whether the photos came during the pass or after it.
  City one_by_one;
  one_by_one.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}, {22.8, 90}, {23.5, 90}});
  const DensePassTools tools{*one_by_one.parts().writer, *one_by_one.parts().pool, nullptr, {}, {}};
  ASSERT_OK(RunDensePass(tools, id_, SmallOptions()));
  one_by_one.Add(more);
  ASSERT_OK(RunDensePass(tools, id_, SmallOptions()));
  EXPECT_EQ(city_.Digest(), one_by_one.Digest());
}

TEST_F(DensePassTest, EndsWhereItsReconstructionIsMergedAway) {
  const DenseProgress merge = [&](std::string_view stage, size_t done, size_t) {
    if (stage != "checks" || done != 2) return;
    Writer::Turn turn = writer_.Take();
    auto record = turn.database().GetSnapshot()->GetReconstruction(id_);
    ASSERT_OK(record);
    record->merged_into = ReconstructionId(99);
    const auto transaction = turn.database().BeginTransaction();
    transaction->PutReconstruction(*record);
    ASSERT_OK(transaction->Commit());
  };
  const auto report = TryPass(SmallOptions(), merge);
  ASSERT_OK(report);
  EXPECT_EQ(report->merged_into, ReconstructionId(99));
  EXPECT_EQ(report->depths.computed, 6u);
  EXPECT_EQ(report->triangles, 0u);
  const auto dense_entries = [&] {
    size_t count = 0;
    EXPECT_OK(database()->GetSnapshot()->dense().ScanAll([&](uint8_t, auto, auto) { ++count; }));
    return count;
  };
  EXPECT_GT(dense_entries(), 0u);
  const auto swept = SweepMerged(writer_);
  ASSERT_OK(swept);
  EXPECT_EQ(*swept, 1u);
  EXPECT_EQ(dense_entries(), 0u);
  EXPECT_EQ(*SweepMerged(writer_), 0u);
}

}  // namespace
}  // namespace veduta
