// SPDX-License-Identifier: Apache-2.0
// Goal: submaps follow what becomes of their images: a photo joins the one that it shares most
//   points with, a small part that is merged does so, too, a larger one becomes a submap of its
//   own and makes the seam due; images that leave are in none any more, an empty one is deleted.
// Method: synthetic maps whose changes are made by hand, over submaps stored in a database.
#include "engine/ingest/submaps.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

constexpr ReconstructionId kCity(1), kOther(2);
constexpr SceneOptions kArc{.camera_count = 24, .point_count = 400, .arc_deg = 50};

std::vector<uint32_t> Range(uint32_t begin, uint32_t end) {
  std::vector<uint32_t> range;
  for (uint32_t k = begin; k < end; ++k) range.push_back(k);
  return range;
}

std::vector<ImageId> Ids(uint32_t begin, uint32_t end) {
  std::vector<ImageId> ids;
  for (const uint32_t k : Range(begin, end)) ids.push_back(ImageId(k + 1));
  return ids;
}

// A city of cameras 0 to 5 in two submaps, and another reconstruction of cameras [6, end).
class SubmapsTest : public testing::Test {
 protected:
  void Fill(uint32_t end) {
    scene_.AddImages(0, 24);
    scene_.LimitTracks(2);  // the nearer the more points are shared
    ASSERT_EQ(scene_.AddReconstruction(Range(0, 6)), kCity);
    if (end > 6) {
      ASSERT_EQ(scene_.AddReconstruction(Range(6, end)), kOther);
    }
    Put({{SubmapId(1), kCity, Ids(0, 3), 3}, {SubmapId(2), kCity, Ids(3, 6), 3}});
  }
  void Put(const std::vector<SubmapRecord>& submaps) {
    const auto transaction = scene_.database()->BeginTransaction();
    for (const SubmapRecord& submap : submaps) transaction->PutSubmap(submap);
    ASSERT_OK(transaction->Commit());
  }
  Submaps Read() { return *Submaps::Read(*scene_.Snap()); }
  std::vector<SubmapRecord> Written(const Submaps& submaps) {
    const auto transaction = scene_.database()->BeginTransaction();
    submaps.Write(transaction.get());
    EXPECT_OK(transaction->Commit());
    return *scene_.Snap()->ListSubmaps();
  }
  // The map of the city with these cameras, of which only those from `fresh` on have changed.
  CityMap Grown(uint32_t fresh, uint32_t end) {
    CityMap map = scene_.MapOf(Range(0, end), kCity);
    map.ClearChanges();
    for (const ImageId id : Ids(fresh, end)) map.SetPose(id, map.image(id).cam_from_world);
    return map;
  }
  // What is written once the other has been merged into the city around these images.
  std::vector<SubmapRecord> Merged(const CityMap& map, const std::vector<ImageId>& around) {
    Submaps submaps = Read();
    Placement placement;
    placement.reconstruction = kCity;
    placement.merges = {{kOther, {}, 0, ""}};
    placement.around = around;
    EXPECT_OK(submaps.FollowPlacement(map, *scene_.Snap(), placement));
    return Written(submaps);
  }

  SceneDatabase scene_{kArc};
};

TEST_F(SubmapsTest, AreFoundByTheirImages) {
  Fill(9);
  const Submaps submaps = Read();
  EXPECT_TRUE(submaps.IsParted(kCity));
  EXPECT_FALSE(submaps.IsParted(kOther));
  EXPECT_EQ(submaps.FindOf(ImageId(5))->id, SubmapId(2));
  EXPECT_EQ(submaps.FindOf(ImageId(7)), nullptr);
  EXPECT_EQ(submaps.Find(SubmapId(3)), nullptr);
  EXPECT_EQ(Written(submaps).size(), 2u);
}

TEST_F(SubmapsTest, APhotoJoinsTheNearest) {
  Fill(6);
  Submaps submaps = Read();
  Placement placement;
  placement.reconstruction = kCity;
  placement.placed = Ids(6, 8);
  ASSERT_OK(submaps.FollowPlacement(Grown(6, 8), *scene_.Snap(), placement));
  std::vector<SubmapRecord> written = Written(submaps);
  EXPECT_EQ(written[0].images, Ids(0, 3));
  EXPECT_EQ(written[1].images, Ids(3, 8)) << "the second by way of the first";
  EXPECT_EQ(written[1].images_at_adjustment, 3u);
  submaps = Read();
  placement.doubtful = placement.placed.front();
  placement.placed = Ids(8, 9);
  ASSERT_OK(submaps.FollowPlacement(Grown(8, 9), *scene_.Snap(), placement));
  written = Written(submaps);
  EXPECT_EQ(written[0].images_at_adjustment, 3u);
  EXPECT_EQ(written[1].images_at_adjustment, 0u) << "it raises doubt";
  EXPECT_EQ(Read().ListDue(kCity, {}), std::vector{SubmapId(2)});
}

TEST_F(SubmapsTest, ASmallPartThatIsMergedJoins) {
  Fill(10);
  const std::vector<SubmapRecord> written = Merged(Grown(6, 10), Ids(0, 2));
  ASSERT_EQ(written.size(), 2u);
  EXPECT_EQ(written[1].images, Ids(3, 10));
  EXPECT_EQ(written[0].images_at_adjustment, 3u) << "so few make nothing due";
}

TEST_F(SubmapsTest, ALargePartThatIsMergedBecomesOne) {
  Fill(24);
  const std::vector<SubmapRecord> written = Merged(Grown(6, 24), Ids(5, 8));
  ASSERT_EQ(written.size(), 3u);
  EXPECT_EQ(written[2].images, Ids(6, 24));
  EXPECT_EQ(written[2].images_at_adjustment, 0u);
  EXPECT_EQ(written[1].images_at_adjustment, 0u) << "it lies at the seam";
  EXPECT_EQ(written[0].images_at_adjustment, 3u) << "it does not";
}

TEST_F(SubmapsTest, SubmapsGoWithTheirReconstruction) {
  Fill(12);
  Put({{SubmapId(7), kOther, Ids(6, 9), 3}, {SubmapId(8), kOther, Ids(9, 12), 3}});
  Submaps submaps = Read();
  ASSERT_OK(submaps.Follow(Grown(6, 12), *scene_.Snap()));
  const std::vector<SubmapRecord> written = Written(submaps);
  ASSERT_EQ(written.size(), 4u);
  for (const SubmapRecord& submap : written) EXPECT_EQ(submap.reconstruction, kCity);
  EXPECT_EQ(written[3].images, Ids(9, 12));
}

TEST_F(SubmapsTest, ImagesThatLeaveAreInNone) {
  Fill(6);
  Submaps submaps = Read();
  CityMap map = scene_.MapOf(Range(0, 6), kCity);
  map.ClearChanges();
  map.UnplaceImage(ImageId(1));
  for (const ImageId id : Ids(3, 6)) map.MoveImage(id, kOther, Sim3());
  ASSERT_OK(submaps.Follow(map, *scene_.Snap()));
  const std::vector<SubmapRecord> written = Written(submaps);
  ASSERT_EQ(written.size(), 1u) << "of the second, all were split off";
  EXPECT_EQ(written[0].images, Ids(1, 3));
  EXPECT_EQ(written[0].images_at_adjustment, 2u);
}

TEST_F(SubmapsTest, OneIsDueWhenItHasGrown) {
  Fill(6);
  Put({{SubmapId(1), kCity, Ids(0, 6), 3}});
  AdjustmentSchedule schedule{.submap_views_step = 4};
  EXPECT_TRUE(Read().ListDue(kCity, schedule).empty());
  schedule.submap_views_step = 3;
  EXPECT_EQ(Read().ListDue(kCity, schedule), std::vector{SubmapId(1)});
  EXPECT_TRUE(Read().ListDue(kOther, schedule).empty());
}

TEST_F(SubmapsTest, OneThatIsTooLargeIsDue) {
  Fill(6);
  Put({{SubmapId(1), kCity, Ids(0, 6), 6}});
  AdjustmentSchedule schedule{.submap_images_max = 6};
  EXPECT_TRUE(Read().ListDue(kCity, schedule).empty());
  schedule.submap_images_max = 5;
  EXPECT_EQ(Read().ListDue(kCity, schedule), std::vector{SubmapId(1)});
}

}  // namespace
}  // namespace veduta
