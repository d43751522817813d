// SPDX-License-Identifier: Apache-2.0
// Goal: what the dense pass stores is read back as it was, sorts by signed places, goes when
//   it is deleted.
// Method: one of everything, written, closed, opened and compared.
#include "storage/dense.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <tuple>
#include <vector>

#include "dense_samples.h"

namespace veduta {
namespace {

bool Same(const Rigid3& a, const Rigid3& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

template <typename Record>
void ExpectSameGeometry(const Record& a, const Record& b) {
  EXPECT_EQ(a.image, b.image);
  EXPECT_EQ(a.reconstruction, b.reconstruction);
  EXPECT_EQ(a.version, b.version);
  EXPECT_EQ(std::tie(a.width_px, a.height_px, a.fx, a.fy, a.cx, a.cy, a.depth_near, a.depth_far,
                     a.known_count),
            std::tie(b.width_px, b.height_px, b.fx, b.fy, b.cx, b.cy, b.depth_near, b.depth_far,
                     b.known_count));
  EXPECT_TRUE(Same(a.cam_from_world, b.cam_from_world));
}

const std::vector<GridPlace> kPlaces = {{-1, 0, 0}, {0, -7, 2}, {0, 0, 0}, {5, 0, -1}};
const std::vector<uint8_t> kBlock = {1, 2, 3};

// One of everything, written in no order; then the database is closed and opened again.
class DenseTest : public testing::Test {
 protected:
  void SetUp() override {
    {
      const auto database = MustCreate(folder_ / "db");
      const auto transaction = database->BeginTransaction();
      PutEverything(&transaction->dense());
      ASSERT_OK(transaction->Commit());
    }
    database_ = MustOpen(folder_ / "db", {});
    snapshot_ = database_->GetSnapshot();
  }

  static void PutEverything(DenseWriter* dense) {
    dense->PutSettings({kCity, 0.05, 512, 2});
    for (const uint32_t image : {7u, 1u}) {
      dense->PutDepth(SampleDepth(image));
      dense->PutDepthPixels(ImageId(image), SamplePixels());
    }
    for (const uint64_t version : {6u, 5u})
      dense->PutCheckedDepth(SampleChecked(7, version), SamplePixels());
    for (const GridPlace place : {kPlaces[2], kPlaces[0], kPlaces[3], kPlaces[1]}) {
      dense->PutTile(SampleTile(place));
      dense->PutVolumeBlock(kCity, place, 63, kBlock);
      for (const SurfacePart part : {SurfacePart::kSolution, SurfacePart::kMesh,
                                     SurfacePart::kColors, SurfacePart::kFirstRound}) {
        dense->PutSurface(part, kCity, place, kBlock);
      }
    }
  }

  const DenseReader& dense() const { return snapshot_->dense(); }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
  std::shared_ptr<const Snapshot> snapshot_;
};

TEST_F(DenseTest, SettingsAreReadBack) {
  const auto settings = dense().FindSettings(kCity);
  ASSERT_TRUE(settings.ok() && *settings);
  EXPECT_EQ(**settings, (DenseSettings{kCity, 0.05, 512, 2}));
  EXPECT_EQ(dense().ListSettings()->size(), 1u);
}

TEST_F(DenseTest, DepthMapsAreReadBackByAscendingImages) {
  std::vector<uint32_t> images;
  ASSERT_OK(dense().ScanDepths([&](const DepthRecord& depth) {
    images.push_back(depth.image.value);
    const DepthRecord expected = SampleDepth(depth.image.value);
    ExpectSameGeometry(depth, expected);
    EXPECT_EQ(depth.sensors.size(), 2u);
    EXPECT_EQ(depth.sensors[0].image, ImageId(9));
    EXPECT_TRUE(Same(depth.sensors[1].cam_from_world, expected.sensors[1].cam_from_world));
    EXPECT_EQ(depth.gain, expected.gain);
    EXPECT_EQ(depth.checked_version, 5u);
    EXPECT_EQ(depth.geometry_version, 77u);
    return true;
  }));
  EXPECT_EQ(images, (std::vector<uint32_t>{1, 7}));
  EXPECT_EQ(dense().GetDepthPixels(ImageId(1))->codes, SamplePixels().codes);
}

TEST_F(DenseTest, CheckedDepthMapsAreReadBackByAscendingVersions) {
  std::vector<uint64_t> versions;
  ASSERT_OK(dense().ScanCheckedDepths([&](const CheckedDepthRecord& depth) {
    versions.push_back(depth.version);
    ExpectSameGeometry(depth, SampleChecked(7, depth.version));
    EXPECT_EQ(depth.blocks, SampleChecked(7, 5).blocks);
    EXPECT_EQ(depth.neighbors, SampleChecked(7, 5).neighbors);
    return true;
  }));
  EXPECT_EQ(versions, (std::vector<uint64_t>{5, 6}));
  EXPECT_EQ(dense().GetCheckedDepthPixels(ImageId(7), 6)->confidence, SamplePixels().confidence);
}

TEST_F(DenseTest, TilesAreReadBackBySignedPlaces) {
  std::vector<GridPlace> seen;
  ASSERT_OK(dense().ScanTiles(kCity, [&](const TileRecord& tile) {
    seen.push_back(tile.place);
    const TileRecord expected = SampleTile(tile.place);
    EXPECT_EQ(tile.depths, expected.depths);
    EXPECT_EQ(
        std::tie(tile.blocks, tile.volume_version, tile.histogram_version, tile.first_round_version,
                 tile.solution_version, tile.mesh_version, tile.color_version),
        std::tie(expected.blocks, expected.volume_version, expected.histogram_version,
                 expected.first_round_version, expected.solution_version, expected.mesh_version,
                 expected.color_version));
    EXPECT_EQ(tile.triangle_count, 500u);
    EXPECT_EQ(tile.vertex_count, 300u);
    return true;
  }));
  EXPECT_EQ(seen, kPlaces) << "ascending, below zero first";
  const auto stored = dense().GetVolumeBlock(kCity, kPlaces[1], 63);
  ASSERT_OK(stored);
  EXPECT_TRUE(std::ranges::equal(stored->bytes(), kBlock));
  EXPECT_EQ(dense().GetVolumeBlock(kCity, kPlaces[1], 62).status().code(), StatusCode::kNotFound);
}

TEST_F(DenseTest, WhatIsDeletedGoesWithItsBytesAndNothingElseDoes) {
  const auto transaction = database_->BeginTransaction();
  transaction->dense().DeleteTile(kCity, kPlaces[1]);
  transaction->dense().DeleteDepth(ImageId(1));
  transaction->dense().DeleteCheckedDepth(ImageId(7), 5);
  ASSERT_OK(transaction->Commit());
  const auto later = database_->GetSnapshot();
  EXPECT_FALSE(later->dense().FindTile(kCity, kPlaces[1])->has_value());
  EXPECT_EQ(later->dense().GetVolumeBlock(kCity, kPlaces[1], 63).status().code(),
            StatusCode::kNotFound);
  EXPECT_EQ(later->dense().GetSurface(SurfacePart::kMesh, kCity, kPlaces[1]).status().code(),
            StatusCode::kNotFound);
  EXPECT_TRUE(later->dense().GetSurface(SurfacePart::kMesh, kCity, kPlaces[2]).ok());
  EXPECT_FALSE(later->dense().FindDepth(ImageId(1))->has_value());
  EXPECT_EQ(later->dense().GetDepthPixels(ImageId(1)).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(later->dense().GetCheckedDepth(ImageId(7), 5).status().code(), StatusCode::kNotFound);
  EXPECT_TRUE(later->dense().GetCheckedDepth(ImageId(7), 6).ok());
  EXPECT_TRUE(dense().FindTile(kCity, kPlaces[1])->has_value()) << "a snapshot does not change";
}

TEST_F(DenseTest, AReconstructionGoesWithItsTilesAndKeepsTheMapsOfPhotos) {
  const auto transaction = database_->BeginTransaction();
  transaction->dense().DeleteReconstruction(kCity);
  ASSERT_OK(transaction->Commit());
  size_t left = 0;
  ASSERT_OK(database_->GetSnapshot()->dense().ScanAll([&](uint8_t, auto, auto) { ++left; }));
  EXPECT_EQ(left, 8u) << "two depth maps and two checked ones, record and pixels each";
}

TEST(Dense, SnapshotHasTheStoredSurfaceThatWasDeletedLater) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  const GridPlace place{1, 2, 3};
  for (const bool is_flushed : {false, true}) {
    auto transaction = database->BeginTransaction();
    transaction->dense().PutSurface(SurfacePart::kMesh, kCity, place, SampleBytes(1, 500));
    ASSERT_OK(transaction->Commit());
    if (is_flushed) {
      ASSERT_OK(database->Compact());
    }
    const auto snapshot = database->GetSnapshot();
    transaction = database->BeginTransaction();
    transaction->dense().DeleteReconstruction(kCity);
    ASSERT_OK(transaction->Commit());
    const auto count = [](const Snapshot& seen) {
      int stored = 0;
      EXPECT_OK(seen.ScanStored(Family::kSurface, [&](std::string_view, const auto& value) {
        EXPECT_OK(value);
        return ++stored, true;
      }));
      return stored;
    };
    EXPECT_EQ(count(*snapshot), 1);
    EXPECT_EQ(count(*database->GetSnapshot()), 0);
  }
}

}  // namespace
}  // namespace veduta
