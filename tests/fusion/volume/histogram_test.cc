// SPDX-License-Identifier: Apache-2.0
// Goal: histograms are additive, and what is withdrawn leaves no trace; votes are the distances
//   that they should be; stored bytes come back, and hostile ones are refused.
// Method: maps of a tilted plane and of a sphere; blocks compared byte by byte after additions
//   in other orders and withdrawals; distances against the shapes' own; every shortening and
//   seeded changes of stored bytes.
#include "fusion/volume/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "tests/fusion/volume/synthetic_maps.h"

namespace veduta {
namespace {

const VolumeGrid kGrid = {0.05, 4};
const synthetic::Shapes kWall = {{0, 0, 0}, 0, 2.0};
const synthetic::Shapes kBall = {{0.3, 0.1, 0.2}, 0.5, std::nullopt};

RangeImage ImageOf(const synthetic::Shapes& shapes, const ViewGeometry& view, double noise,
                   uint64_t seed) {
  return RangeImage::Make(synthetic::Render(shapes, view, noise, noise > 0 ? 0.05 : 0, seed), view)
      .value();
}

std::vector<RangeImage> BallImages(double noise) {
  std::vector<RangeImage> images;
  for (const ViewGeometry& view : synthetic::ViewsAround(kBall.center, 3, 96)) {
    images.push_back(ImageOf(kBall, view, noise, images.size()));
  }
  return images;
}

TEST(RangeImage, VotesTheDistanceToAPlaneAtAnyAngle) {
  for (const double x : {-4.0, -1.0, 0.0, 3.0}) {
    const ViewGeometry view = synthetic::LookAt({x, 0, 0.1}, {0, 2, 0}, 160, 120);
    const RangeImage image = ImageOf(kWall, view, 0, 0);
    int votes = 0;
    for (double y = 1.5; y < 2.25; y += 0.03) {
      const auto vote = image.VoteOn({0.02, y, -0.03}, kGrid);
      if (y > 2 + kGrid.truncation()) {
        EXPECT_FALSE(vote) << y;
      }
      if (y > 2 + 0.95 * kGrid.truncation()) continue;
      ASSERT_TRUE(vote) << x << " " << y;
      EXPECT_NEAR(vote->distance, 2 - y, 2e-4 + 0.01 * std::abs(2 - y)) << x << " " << y;
      ++votes;
    }
    EXPECT_GT(votes, 20);
  }
}

TEST(RangeImage, APixelAloneVotesAsIfItFacedTheCamera) {
  const ViewGeometry view = synthetic::LookAt({0, 0, 0}, {0, 2, 0}, 160, 120);
  DepthMap map = synthetic::Render(kWall, view, 0, 0, 1);
  const size_t kept = map.depth.size() / 2 + view.width_px / 2;
  for (size_t i = 0; i < map.depth.size(); ++i)
    if (i != kept) map.depth[i] = 0, map.confidence[i] = 0;
  const RangeImage image = RangeImage::Make(map, view).value();
  const double x = static_cast<double>(kept % view.width_px), z = map.depth[kept],
               y = static_cast<double>(kept / view.width_px);
  const Eigen::Vector3d ray((x - view.camera.cx) / view.camera.fx,
                            (y - view.camera.cy) / view.camera.fy, 1);
  const Rigid3 world_from_cam = view.cam_from_world.Inverse();
  for (const double before : {0.05, 0.15, 0.5}) {
    const auto vote = image.VoteOn(world_from_cam * ((z - before) * ray), kGrid);
    ASSERT_TRUE(vote) << before;
    EXPECT_NEAR(vote->distance, before, 0.1 * before);
  }
  EXPECT_FALSE(image.VoteOn(world_from_cam * ((z + 0.5) * ray), kGrid)) << "far behind";
}

TEST(RangeImage, IsSilentOutsideItsPicture) {
  const ViewGeometry view = synthetic::LookAt({0, 0, 0}, {0, 2, 0}, 160, 120);
  const RangeImage image = ImageOf(kWall, view, 0, 0);
  EXPECT_TRUE(image.VoteOn({0, 1, 0}, kGrid));
  EXPECT_FALSE(image.VoteOn({0, -1, 0}, kGrid));
  EXPECT_FALSE(image.VoteOn({3, 1, 0}, kGrid));
  EXPECT_FALSE(image.VoteOn({0, 1, 3}, kGrid));
  EXPECT_FALSE(image.VoteOn({0, 1, 0}, {0.001, 4})) << "pixels wider than two voxels";
}

TEST(RangeImage, NamesTheBlocksNearSurface) {
  const ViewGeometry view = synthetic::ViewsAround(kBall.center, 3, 96)[0];
  const DepthMap map = synthetic::Render(kBall, view, 0, 0, 0);
  const RangeImage image = RangeImage::Make(map, view).value();
  // Every pixel's cube of one truncation each way, corner by corner: less than a block, so corners
  // name all.
  std::map<GridPlace, uint32_t> expected;
  for (uint32_t i = 0; i < map.depth.size(); ++i) {
    if (map.depth[i] == 0) continue;
    const Eigen::Vector2d at = view.camera.Normalize(Eigen::Vector2d(i % 96, i / 96));
    const Eigen::Vector3d point =
        view.cam_from_world.Inverse() * (map.depth[i] * Eigen::Vector3d(at.x(), at.y(), 1));
    std::set<GridPlace> blocks;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      const Eigen::Array3d block =
          ((point + kGrid.truncation() * sign) / (kBlockSide * kGrid.voxel_size)).array().floor();
      blocks.insert(
          {static_cast<int>(block.x()), static_cast<int>(block.y()), static_cast<int>(block.z())});
    }
    for (const GridPlace& block : blocks) ++expected[block];
  }
  std::vector<NamedBlock> all;
  for (const auto& [block, count] : expected) all.push_back({block, count});
  EXPECT_EQ(image.BlocksNearSurface(kGrid), all);
}

TEST(RangeImage, SeesNothingWhereItSaysSo) {
  const RangeImage image = BallImages(0)[0];
  int unseen = 0;
  for (int32_t i = 0; i < 125; ++i) {
    const GridPlace at = {2 * (i % 5) - 5, 2 * (i / 5 % 5) - 5, 2 * (i / 25) - 5};
    HistogramBlock block;
    if (image.MaySee(at, kGrid)) continue;
    ++unseen;
    for (int voxel = 0; voxel < kBlockVoxels; ++voxel) {
      const Eigen::Vector3d in_block(voxel % 16 + 0.5, voxel / 16 % 16 + 0.5, voxel / 256 + 0.5);
      const Eigen::Vector3d center =
          (Eigen::Vector3d(at.x, at.y, at.z) * kBlockSide + in_block) * kGrid.voxel_size;
      ASSERT_FALSE(image.VoteOn(center, kGrid));
    }
  }
  EXPECT_GT(unseen, 20);
}

TEST(RangeImage, RefusesWhatIsNoDepth) {
  const ViewGeometry view = synthetic::LookAt({0, 0, 0}, {0, 2, 0}, 16, 12);
  const DepthMap good = synthetic::Render(kWall, view, 0, 0, 0);
  DepthMap map = good;
  map.depth[5] = -1;
  EXPECT_EQ(RangeImage::Make(map, view).status().code(), StatusCode::kInvalidArgument);
  map.depth[5] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(RangeImage::Make(map, view).status().code(), StatusCode::kInvalidArgument);
  map = good;
  map.confidence.pop_back();
  EXPECT_EQ(RangeImage::Make(map, view).status().code(), StatusCode::kInvalidArgument);
}

TEST(HistogramBlock, IsTheSameInAnyOrderAndAfterWithdrawal) {
  const std::vector<RangeImage> images = BallImages(0.02);
  const GridPlace at = {0, 0, 0};
  HistogramBlock forward, backward, without;
  for (size_t i = 0; i < images.size(); ++i) {
    ASSERT_TRUE(Integrate(images[i], kGrid, at, 1, &forward).value().changed);
    ASSERT_TRUE(Integrate(images[images.size() - 1 - i], kGrid, at, 1, &backward).ok());
    if (i % 3 != 0) {
      ASSERT_TRUE(Integrate(images[i], kGrid, at, 1, &without).ok());
    }
  }
  EXPECT_EQ(forward, backward);
  EXPECT_NE(forward, without);
  for (size_t i = 0; i < images.size(); i += 3)
    ASSERT_TRUE(Integrate(images[i], kGrid, at, -1, &forward).ok());
  EXPECT_EQ(forward, without);
  for (size_t i = 0; i < images.size(); ++i) {
    if (i % 3 != 0) {
      ASSERT_TRUE(Integrate(images[i], kGrid, at, -1, &forward).ok());
    }
  }
  EXPECT_TRUE(forward.IsEmpty());
  EXPECT_EQ(forward, HistogramBlock());
}

TEST(HistogramBlock, KeepsTheMeanWithinItsBins) {
  const ViewGeometry view = synthetic::LookAt({0.1, 0, 0.1}, {0.4, 2, 0.4}, 320, 320);
  HistogramBlock block;
  ASSERT_TRUE(Integrate(ImageOf(kWall, view, 0, 0), kGrid, {0, 2, 0}, 1, &block).ok());
  int near = 0;
  for (int32_t y = 0; y < kBlockSide; ++y) {
    const size_t voxel = VoxelOffset(8, y, 8);
    const double truth = (2 - (32 + y + 0.5) * 0.05) / kGrid.truncation();
    for (int bin = 0; bin < kNearBins; ++bin) {
      if (block.counts[bin][voxel] == 0) continue;
      EXPECT_NEAR(block.CenterOf(bin, voxel), truth, 1.01 / (kNearBins * kLevels)) << y;
      EXPECT_EQ(block.near_maps[voxel], 1);
      ++near;
    }
  }
  EXPECT_EQ(near, 8);  // four voxels on either side
}

TEST(HistogramBlock, RefusesWhatItCannotCount) {
  const std::vector<RangeImage> images = BallImages(0);
  HistogramBlock block;
  EXPECT_EQ(Integrate(images[0], kGrid, {0, 0, 0}, -1, &block).status().code(),
            StatusCode::kInvalidArgument);
  EXPECT_TRUE(block.IsEmpty());
  EXPECT_EQ(Integrate(images[0], kGrid, {0, 0, 0}, 2, &block).status().code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(Integrate(images[0], {0, 4}, {0, 0, 0}, 1, &block).status().code(),
            StatusCode::kInvalidArgument);
  for (auto& plane : block.counts) plane.back() = 65535;
  const HistogramBlock full = block;
  Status status;
  for (const RangeImage& image : images) {
    const Result<Integration> result = Integrate(image, kGrid, {0, 0, 0}, 1, &block);
    if (result.ok()) continue;
    status = result.status();
    for (size_t i = 0; i + 1 < images.size() && &images[i] != &image; ++i) {
      ASSERT_TRUE(Integrate(images[i], kGrid, {0, 0, 0}, -1, &block).ok());
    }
    break;
  }
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(block, full) << "what failed left something behind";
}

TEST(HistogramBlock, SurvivesStorageAndRefusesHostileBytes) {
  HistogramBlock block;
  for (const RangeImage& image : BallImages(0.02))
    ASSERT_TRUE(Integrate(image, kGrid, {0, 0, 0}, 1, &block).ok());
  const std::vector<uint8_t> bytes = Serialize(block);
  EXPECT_LT(bytes.size(), sizeof(HistogramBlock) / 2);
  EXPECT_EQ(*ParseHistogramBlock(bytes).value(), block);
  SeededRandom random(1);
  for (int i = 0; i < 200; ++i) {
    const size_t length = random.Below(static_cast<uint32_t>(bytes.size()));
    EXPECT_EQ(ParseHistogramBlock(std::span(bytes).first(length)).status().code(),
              StatusCode::kCorruption)
        << length;
  }
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<uint8_t> damaged = bytes;
    damaged[random.Below(static_cast<uint32_t>(bytes.size()))] ^=
        static_cast<uint8_t>(1 + random.Below(255));
    const auto parsed = ParseHistogramBlock(damaged);
    // What is accepted is a block whose bytes are just these.
    if (parsed.ok()) {
      EXPECT_EQ(Serialize(**parsed), damaged);
    }
    refused += parsed.ok() ? 0 : 1;
  }
  EXPECT_GT(refused, 100);
  std::vector<uint8_t> longer = bytes;
  longer.push_back(0);
  EXPECT_EQ(ParseHistogramBlock(longer).status().code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseHistogramBlock({}).status().code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
