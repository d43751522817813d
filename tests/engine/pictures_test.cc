// SPDX-License-Identifier: Apache-2.0
// Goal: lists of images, photos, small pictures and points are those of the snapshot, page by page.
// Method: a street in a database, one photo of which is removed and one of which is no photo.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "engine/camera/photo_decoder.h"
#include "engine/parts.h"
#include "engine/query/even_order.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

class Pictures : public testing::Test {
 protected:
  void SetUp() override {
    city_.Add(walk_);
    city_.AddOne("letter.txt", {'n', 'o'});
    RemoveRequest request;
    request.photos = {TakePhoto(walk_[2]).name};
    ASSERT_OK(city_.engine().Remove(request));
  }

  const std::vector<Stand> walk_ = Walk(5, 0.6, 7);
  City city_;
};

TEST_F(Pictures, ImagesComePageByPage) {
  Questions ask = city_.engine().Ask();
  const auto all = ask.Images(ImageId(1), 100);
  ASSERT_OK(all);
  std::vector<uint32_t> ids, paged;
  for (const ListedImage& image : *all) {
    ids.push_back(image.id.value);
    const auto shown = ask.Image("#" + std::to_string(image.id.value));
    ASSERT_OK(shown);
    EXPECT_EQ(image.name, shown->name);
    EXPECT_EQ(image.contributor, shown->contributor);
    EXPECT_EQ(image.verdict, shown->verdict);
    EXPECT_EQ(image.reconstruction, shown->reconstruction);
    EXPECT_EQ(image.is_unsure, !shown->may_stand_in.empty());
    ASSERT_EQ(image.cam_from_world.has_value(), shown->cam_from_world.has_value());
    if (image.cam_from_world) {
      EXPECT_EQ(image.cam_from_world->center, shown->cam_from_world->center);
    }
  }
  EXPECT_EQ(ids, (std::vector<uint32_t>{1, 2, 4, 5, 6, 7, 8}));
  for (ImageId next(1);;) {
    const auto page = ask.Images(next, 2);
    ASSERT_OK(page);
    if (page->empty()) break;
    EXPECT_LE(page->size(), 2u);
    for (const ListedImage& image : *page) paged.push_back(image.id.value);
    next = ImageId(page->back().id.value + 1);
  }
  EXPECT_EQ(paged, ids);
  EXPECT_TRUE(ask.Images(ImageId(1), 0)->empty());
  EXPECT_TRUE(ask.Images(ImageId(100), 5)->empty());
  EXPECT_TRUE(ask.Images(ImageId(~0u), 5)->empty());
}

TEST_F(Pictures, PhotosAreTheBytesThatCame) {
  const Questions ask = city_.engine().Ask();
  const TakenPhoto& photo = TakePhoto(walk_[1]);
  const auto file = ask.Photo(photo.name);
  ASSERT_OK(file);
  EXPECT_EQ(file->media_type, "image/jpeg");
  EXPECT_EQ(file->bytes, photo.jpeg);
  EXPECT_EQ(ask.Photo("letter.txt").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(ask.Photo("none").status().code(), StatusCode::kNotFound);
}

TEST_F(Pictures, SmallPicturesAreSmall) {
  const Questions ask = city_.engine().Ask();
  const std::string name = TakePhoto(walk_[1]).name;
  const auto small = ask.Thumbnail(name, 128);
  ASSERT_OK(small);
  EXPECT_EQ(small->media_type, "image/jpeg");
  EXPECT_EQ(DecodePhoto(small->bytes, {}).upright_size, (ImageSize{128, 96}));
  for (const uint32_t side : {0u, kThumbnailSideMax + 1})
    EXPECT_EQ(ask.Thumbnail(name, side).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(ask.Thumbnail("letter.txt", 128).status().code(), StatusCode::kNotFound);
}

TEST_F(Pictures, PointsAreThoseOfTheReconstruction) {
  const Questions ask = city_.engine().Ask();
  const auto living = ask.Reconstructions();
  ASSERT_OK(living);
  ASSERT_FALSE(living->empty());
  const auto cloud = ask.Points(living->front().id);
  ASSERT_OK(cloud);
  EXPECT_EQ(cloud->positions.size(), living->front().points);
  EXPECT_EQ(cloud->rgb.size(), cloud->positions.size());
  EXPECT_EQ(cloud->geometry_version, living->front().geometry_version);
  const std::set<std::array<float, 3>> different(cloud->positions.begin(), cloud->positions.end());
  EXPECT_GT(different.size(), cloud->positions.size() / 2);
  // Their beginning is an even sample.
  std::vector<std::array<float, 3>> stored;
  const auto snapshot = city_.parts().database->GetSnapshot();
  const auto record = snapshot->GetReconstruction(living->front().id);
  ASSERT_OK(record);
  ASSERT_OK(snapshot->ScanPointBlocks(record->id, record->points_generation,
                                      [&](const PointBlock& block) {
                                        for (const PointRecord& point : block.points) {
                                          const Eigen::Vector3f x = point.position.cast<float>();
                                          stored.push_back({x.x(), x.y(), x.z()});
                                        }
                                        return true;
                                      }));
  EXPECT_EQ(cloud->positions, InEvenOrder(stored));
  EXPECT_EQ(ask.Points(ReconstructionId(99)).status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
