// SPDX-License-Identifier: Apache-2.0
// Goal: a photo that loses its pose while a dense pass is at work, in whichever stage, is in
//   nothing of what that pass and the next one leave; what an earlier program left of such a pass
//   is mended.
// Method: photos of a rendered street in a real database; the pose of one is forbidden from within
//   the pass, at one stage after the other.
#include <gtest/gtest.h>

#include <algorithm>

#include "fusion/pass/dense_invariants.h"
#include "fusion/pass/dense_pass.h"
#include "fusion/pass/tile_parts.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

const ImageId kTaken(3);

class Overtaken : public testing::Test {
 protected:
  void SetUp() override {
    std::vector<Stand> stands;
    for (int i = 0; i < 7; ++i) stands.push_back({20 + 0.7 * i, 90});
    city_.Add(stands);
    ASSERT_EQ(city_.Counts().placed, stands.size());
    id_ = city_.Ask().Pose(kTaken)->value().reconstruction;
  }

  DensifyReport Pass(DenseProgress progress = {}) {
    DensifyOptions options;
    options.depth_side_px = 96;
    const auto report = RunDensePass({*city_.parts().writer,
                                      *city_.parts().pool,
                                      /*device=*/nullptr,
                                      std::move(progress),
                                      {}},
                                     id_, options);
    EXPECT_OK(report);
    return report.ok() ? *report : DensifyReport();
  }

  ForbidRequest ItsPose() const {
    ForbidRequest request;
    request.kind = ForbidKind::kPose;
    request.a = "#" + std::to_string(kTaken.value);
    return request;
  }
  void TakePose() { ASSERT_OK(city_.engine().Forbid(ItsPose())); }
  void GivePose() {
    ASSERT_OK(city_.engine().Allow(ItsPose()));
    ASSERT_OK(city_.engine().Settle());
    ASSERT_TRUE(city_.Ask().Pose(kTaken)->has_value());
  }

  void ExpectSoundWithoutIt() {
    const CityQuestions ask = city_.Ask();
    const auto violations = FindDenseViolations(ask.snapshot(), 10);
    ASSERT_OK(violations);
    for (const std::string& violation : *violations) ADD_FAILURE() << violation;
    EXPECT_FALSE(ask.snapshot().dense().FindDepth(kTaken)->has_value());
    size_t tiles = 0;
    ASSERT_OK(ask.snapshot().dense().ScanTiles(id_, [&](const TileRecord& tile) {
      ++tiles;
      EXPECT_TRUE(std::ranges::none_of(
          tile.depths, [](const DepthVersion& depth) { return depth.image == kTaken; }));
      return true;
    }));
    EXPECT_GT(tiles, 0u);
  }

  City city_;
  ReconstructionId id_;
};

TEST_F(Overtaken, APhotoThatLosesItsPoseIsInNothing) {
  for (const std::string at : {"depth maps", "checks", "volume", "fusion", "surface", "colours"}) {
    SCOPED_TRACE(at);
    Pass();
    // Something is to be made in every stage.
    const auto transaction = city_.parts().database->BeginTransaction();
    PoseRecord pose = city_.Ask().Pose(ImageId(4))->value();
    pose.cam_from_world.translation.x() += 0.05;
    transaction->PutPose(pose);
    ASSERT_OK(transaction->Commit());
    bool is_taken = false;
    Pass([&](std::string_view stage, size_t done, size_t) {
      if (stage != at || done != 2 || std::exchange(is_taken, true)) return;
      TakePose();
    });
    EXPECT_TRUE(is_taken);
    ExpectSoundWithoutIt();
    EXPECT_EQ(Pass().depths.computed, 0u) << "nothing was left to do";
    ExpectSoundWithoutIt();
    GivePose();
  }
}

TEST_F(Overtaken, WhatAnEarlierProgramLeftIsMended) {
  Pass();
  const CityQuestions before = city_.Ask();
  std::vector<TileRecord> tiles;
  ASSERT_OK(before.snapshot().dense().ScanTiles(id_, [&](const TileRecord& tile) {
    tiles.push_back(tile);
    return true;
  }));
  const DepthRecord depth = before.snapshot().dense().FindDepth(kTaken)->value();
  const DepthPixels pixels = *before.snapshot().dense().GetDepthPixels(kTaken);
  TakePose();
  // Its map came back, and records of tiles without their blocks, with maps that are gone.
  const auto transaction = city_.parts().database->BeginTransaction();
  transaction->dense().PutDepth(depth);
  transaction->dense().PutDepthPixels(kTaken, pixels);
  for (const TileRecord& tile : tiles) transaction->dense().PutTile(tile);
  ASSERT_OK(transaction->Commit());
  EXPECT_FALSE(FindDenseViolations(city_.Ask().snapshot(), 10)->empty());
  Pass();
  ExpectSoundWithoutIt();
}

TEST(KeepSome, KeepsTheSameWhicheverOthersThereAre) {
  std::vector<DepthVersion> all;
  for (uint32_t id = 50; id > 0; --id) all.push_back({ImageId(id), 0, 7});
  std::vector<DepthVersion> few = all, enough = all;
  KeepSome(20, &few);
  ASSERT_EQ(few.size(), 20u);
  EXPECT_TRUE(std::ranges::is_sorted(few));
  KeepSome(50, &enough);
  EXPECT_EQ(enough.size(), 50u);
  EXPECT_TRUE(std::ranges::is_sorted(enough));
  // One that is not kept makes no difference by going.
  std::vector<DepthVersion> without = enough;
  for (const DepthVersion& depth : enough) {
    if (std::ranges::binary_search(few, depth)) continue;
    std::erase(without, depth);
    break;
  }
  KeepSome(20, &without);
  EXPECT_EQ(without, few);
}

}  // namespace
}  // namespace veduta
