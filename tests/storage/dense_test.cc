// SPDX-License-Identifier: Apache-2.0
// Goal: what the offline pass stores is read back as it was, sorts by signed places, goes when
//   it is deleted, and a damaged or senseless record is refused by name.
// Method: one of everything, written, closed, opened and compared; every record with one field
//   broken; values cut at every length and with bytes turned.
#include "storage/dense.h"

#include <gtest/gtest.h>

#include <limits>

#include "samples.h"
#include "storage/dense_codec.h"

namespace veduta {
namespace {

constexpr ReconstructionId kCity{3};

Rigid3 SamplePose(double turn) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d(1, 2, 3).normalized())),
          {turn, -turn, 2 * turn}};
}

DepthRecord SampleDepth(uint32_t image) {
  DepthRecord d;
  d.image = ImageId(image);
  d.reconstruction = kCity;
  d.version = 0xFEDCBA9876543210u + image;
  d.geometry_version = 77;
  d.width_px = 8, d.height_px = 4;
  d.fx = 7, d.fy = 7.5, d.cx = 3.5, d.cy = 1.5;
  d.cam_from_world = SamplePose(0.3);
  d.depth_near = 0.5, d.depth_far = 20;
  d.sensors = {{ImageId(9), SamplePose(0.1)}, {ImageId(2), SamplePose(0.2)}};
  d.known_count = 30;
  d.checked_version = 5;
  d.gain = {1, 0.9f, 1.1f};
  return d;
}

CheckedDepthRecord SampleChecked(uint32_t image, uint64_t version) {
  CheckedDepthRecord d;
  d.image = ImageId(image);
  d.reconstruction = kCity;
  d.version = version;
  d.width_px = 8, d.height_px = 4;
  d.fx = 7, d.fy = 7.5, d.cx = 3.5, d.cy = 1.5;
  d.cam_from_world = SamplePose(0.4);
  d.depth_near = 0.5, d.depth_far = 20;
  d.known_count = 28;
  d.neighbors = {{ImageId(9), 0, 4}, {ImageId(2), 0, 3}};
  d.blocks = {{{-2, 5, 1}, 9}, {{-2, 5, 2}, 1}, {{4, -1, 0}, 70}};
  return d;
}

DepthPixels SamplePixels() {
  DepthPixels pixels;
  for (uint16_t i = 0; i < 32; ++i) {
    pixels.codes.push_back(static_cast<uint16_t>(i * 2000));
    pixels.confidence.push_back(static_cast<uint8_t>(i));
  }
  return pixels;
}

TileRecord SampleTile(GridPlace place) {
  return {kCity,
          place,
          0x8000000000000005u,
          {{ImageId(1), 0, 9}, {ImageId(2), 0, 3}, {ImageId(2), 0, 4}},
          1,
          7,
          6,
          2,
          3,
          4,
          500,
          300};
}

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

TEST(Dense, EverythingIsReadBackAfterReopening) {
  const TemporaryFolder folder;
  const std::vector<GridPlace> places = {{-1, 0, 0}, {0, -7, 2}, {0, 0, 0}, {5, 0, -1}};
  const std::vector<uint8_t> block = {1, 2, 3};
  {
    auto database = MustCreate(folder / "db");
    auto transaction = database->BeginTransaction();
    DenseWriter& dense = transaction->dense();
    dense.PutSettings({kCity, 0.05, 512, 2});
    for (const uint32_t image : {7u, 1u}) {
      dense.PutDepth(SampleDepth(image));
      dense.PutDepthPixels(ImageId(image), SamplePixels());
    }
    for (const uint64_t version : {6u, 5u})
      dense.PutCheckedDepth(SampleChecked(7, version), SamplePixels());
    for (const GridPlace place : {places[2], places[0], places[3], places[1]}) {
      dense.PutTile(SampleTile(place));
      dense.PutVolumeBlock(kCity, place, 63, block);
      for (const SurfacePart part : {SurfacePart::kSolution, SurfacePart::kMesh,
                                     SurfacePart::kColors, SurfacePart::kFirstRound}) {
        dense.PutSurface(part, kCity, place, block);
      }
    }
    ASSERT_OK(transaction->Commit());
  }
  auto database = MustOpen(folder / "db", {});
  const auto snapshot = database->GetSnapshot();
  const DenseReader& dense = snapshot->dense();
  const auto settings = dense.FindSettings(kCity);
  ASSERT_TRUE(settings.ok() && *settings);
  EXPECT_EQ(**settings, (DenseSettings{kCity, 0.05, 512, 2}));
  EXPECT_EQ(dense.ListSettings()->size(), 1u);
  std::vector<uint32_t> images;
  ASSERT_OK(dense.ScanDepths([&](const DepthRecord& depth) {
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
  EXPECT_EQ(dense.GetDepthPixels(ImageId(1))->codes, SamplePixels().codes);
  std::vector<uint64_t> versions;
  ASSERT_OK(dense.ScanCheckedDepths([&](const CheckedDepthRecord& depth) {
    versions.push_back(depth.version);
    ExpectSameGeometry(depth, SampleChecked(7, depth.version));
    EXPECT_EQ(depth.blocks, SampleChecked(7, 5).blocks);
    EXPECT_EQ(depth.neighbors, SampleChecked(7, 5).neighbors);
    return true;
  }));
  EXPECT_EQ(versions, (std::vector<uint64_t>{5, 6}));
  EXPECT_EQ(dense.GetCheckedDepthPixels(ImageId(7), 6)->confidence, SamplePixels().confidence);
  std::vector<GridPlace> seen;
  ASSERT_OK(dense.ScanTiles(kCity, [&](const TileRecord& tile) {
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
  EXPECT_EQ(seen, places) << "ascending, below zero first";
  const auto stored = dense.GetVolumeBlock(kCity, places[1], 63);
  ASSERT_OK(stored);
  EXPECT_TRUE(std::ranges::equal(stored->bytes(), block));
  EXPECT_EQ(dense.GetVolumeBlock(kCity, places[1], 62).status().code(), StatusCode::kNotFound);

  auto transaction = database->BeginTransaction();
  transaction->dense().DeleteTile(kCity, places[1]);
  transaction->dense().DeleteDepth(ImageId(1));
  transaction->dense().DeleteCheckedDepth(ImageId(7), 5);
  ASSERT_OK(transaction->Commit());
  const auto later = database->GetSnapshot();
  EXPECT_FALSE(later->dense().FindTile(kCity, places[1])->has_value());
  EXPECT_EQ(later->dense().GetVolumeBlock(kCity, places[1], 63).status().code(),
            StatusCode::kNotFound);
  EXPECT_EQ(later->dense().GetSurface(SurfacePart::kMesh, kCity, places[1]).status().code(),
            StatusCode::kNotFound);
  EXPECT_TRUE(later->dense().GetSurface(SurfacePart::kMesh, kCity, places[2]).ok());
  EXPECT_FALSE(later->dense().FindDepth(ImageId(1))->has_value());
  EXPECT_EQ(later->dense().GetDepthPixels(ImageId(1)).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(later->dense().GetCheckedDepth(ImageId(7), 5).status().code(), StatusCode::kNotFound);
  EXPECT_TRUE(later->dense().GetCheckedDepth(ImageId(7), 6).ok());
  EXPECT_TRUE(snapshot->dense().FindTile(kCity, places[1])->has_value())
      << "a snapshot does not change";

  transaction = database->BeginTransaction();
  transaction->dense().DeleteReconstruction(kCity);
  ASSERT_OK(transaction->Commit());
  size_t left = 0;
  ASSERT_OK(database->GetSnapshot()->dense().ScanAll([&](uint8_t, auto, auto) { ++left; }));
  EXPECT_EQ(left, 4u) << "image 7: depth map and its checked one, record and pixels each";
}

TEST(Dense, SenselessRecordsAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<DepthRecord> depths(8, SampleDepth(1));
  depths[0].image = ImageId();
  depths[1].width_px = 0;
  depths[2].fx = nan;
  depths[3].depth_near = 0;
  depths[4].depth_far = depths[4].depth_near;
  depths[5].cam_from_world.translation.x() = nan;
  depths[6].sensors[0].image = ImageId();
  depths[7].gain[1] = -1;
  for (const DepthRecord& depth : depths)
    EXPECT_EQ(Encode(depth).status().code(), StatusCode::kInvalidArgument);
  CheckedDepthRecord checked = SampleChecked(1, 1);
  std::swap(checked.blocks[0], checked.blocks[1]);
  EXPECT_EQ(Encode(checked).status().code(), StatusCode::kInvalidArgument);
  DepthPixels pixels = SamplePixels();
  pixels.confidence.pop_back();
  EXPECT_EQ(Encode(pixels).status().code(), StatusCode::kInvalidArgument);
  TileRecord tile = SampleTile({});
  tile.depths[2] = tile.depths[1];
  EXPECT_EQ(Encode(tile).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Encode(DenseSettings{kCity, nan, 512, 2}).status().code(),
            StatusCode::kInvalidArgument);
}

TEST(Dense, DamagedValuesNeverComeThroughUnnoticedOrCrash) {
  const std::string depth = *Encode(SampleDepth(1));
  const std::string tile = *Encode(SampleTile({1, 2, 3}));
  SeededRandom random(11);
  for (size_t size = 0; size < depth.size(); ++size) {
    DepthRecord record = SampleDepth(1);
    EXPECT_EQ(Decode(std::string_view(depth).substr(0, size), &record).code(),
              StatusCode::kCorruption)
        << size;
  }
  for (int i = 0; i < 3000; ++i) {
    std::string turned = i % 2 ? depth : tile;
    turned[random.Below(static_cast<uint32_t>(turned.size()))] ^=
        static_cast<char>(1 + random.Below(255));
    DepthRecord record = SampleDepth(1);
    TileRecord other = SampleTile({});
    const Status status = i % 2 ? Decode(turned, &record) : Decode(turned, &other);
    EXPECT_TRUE(status.ok() || status.code() == StatusCode::kCorruption);
    // What is taken can be written again: it keeps every rule.
    if (!status.ok()) continue;
    EXPECT_TRUE(i % 2 ? Encode(record).ok() : Encode(other).ok());
  }
}

}  // namespace
}  // namespace veduta
