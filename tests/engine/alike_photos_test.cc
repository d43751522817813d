// SPDX-License-Identifier: Apache-2.0
// Goal: of many photos those are found that show one place; what shows nothing in common, or is no
//   photo, is not among them.
// Method: photos of a rendered street: some of one place, strewn among others far from each other.
#include "engine/alike_photos.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

// Every third photo, from the second on, is one of a walk; the others show places of their own.
std::vector<PhotoSource> Strewn() {
  const std::vector<Stand> walk = Walk(38, 0.25, 5);
  const std::vector<Stand> others = {{5, 90},   {14, 90},  {23, 90},  {55, 90},  {5, 270},
                                     {14, 270}, {23, 270}, {32, 270}, {41, 270}, {50, 270}};
  std::vector<PhotoSource> photos;
  for (size_t i = 0; i < 15; ++i) {
    const TakenPhoto& photo = TakePhoto(i % 3 == 1 ? walk[i / 3] : others[i / 3 * 2 + i % 3 / 2]);
    photos.push_back({photo.name, photo.name, photo.jpeg});
  }
  return photos;
}

std::vector<size_t> All(size_t count) {
  std::vector<size_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

AlikePhotos LookAt(const std::vector<PhotoSource>& photos, uint32_t threads = 2) {
  ThreadPool pool(threads - 1);
  auto looked = AlikePhotos::Look(photos, DecoderInProcess(), &pool, {});
  EXPECT_OK(looked);
  return *std::move(looked);
}

TEST(AlikePhotos, ThoseOfOnePlaceAreChosen) {
  const AlikePhotos looked = LookAt(Strewn());
  const std::vector<size_t> walk = {1, 4, 7, 10, 13};
  EXPECT_EQ(looked.Choose(All(15), 6), walk);
  const std::vector<size_t> three = looked.Choose(All(15), 3);
  EXPECT_EQ(three.size(), 3u);
  for (const size_t photo : three) EXPECT_EQ(photo % 3, 1u);
  EXPECT_EQ(LookAt(Strewn(), 1).Choose(All(15), 3), three) << "with one thread";
  const std::vector<size_t> some = {0, 1, 2, 3, 4, 8};
  EXPECT_EQ(looked.Choose(some, 6), (std::vector<size_t>{1, 4}));
}

TEST(AlikePhotos, WhereNothingIsAlikeNothingIsChosen) {
  std::vector<PhotoSource> photos = Strewn();
  const std::vector<size_t> others = {0, 2, 6, 11};
  EXPECT_TRUE(LookAt(photos).Choose(others, 6).empty());
  for (PhotoSource& photo : photos) photo.bytes = std::vector<uint8_t>(100, 'a');
  EXPECT_TRUE(LookAt(photos).Choose(All(15), 6).empty());
  EXPECT_TRUE(LookAt({}).Choose({}, 6).empty());
}

TEST(AlikePhotos, CanBeStopped) {
  ThreadPool pool(1);
  std::stop_source stop;
  stop.request_stop();
  const auto looked = AlikePhotos::Look(Strewn(), DecoderInProcess(), &pool, stop.get_token());
  EXPECT_EQ(looked.status().code(), StatusCode::kCancelled);
}

}  // namespace
}  // namespace veduta
