// SPDX-License-Identifier: Apache-2.0
// Goal: photos are found by when and where they were taken, a page at a time, and fast enough among
//   ten thousand.
// Method: records in a database, of which times, positions and poses are given; pages are put
//   together while more photos come, and some go.
#include "engine/query/photo_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

constexpr int64_t kNoon = 1'700'000'000;
constexpr int64_t kHour = 3600;

class PhotoSearchTest : public testing::Test {
 protected:
  // Photos are on a line to the east, a hundredth of a degree apart, an hour after each other; the
  // camera tells the zone of its clock.
  ImageRecord Photo(uint32_t id) const {
    ImageRecord image;
    image.id = ImageId(id);
    image.name = std::to_string(id);
    image.contributor = "anna";
    image.camera = CameraId(1);
    image.verdict = Verdict::kPostponed;
    image.reason = Reason::kNoCandidates;
    image.photo = HashContent(std::span(reinterpret_cast<const uint8_t*>(&id), sizeof(id)));
    image.time_unix_s = kNoon + 100'000 * kHour;
    image.gps = GpsFix{47, 0.01 * (id % 1000), 300, 5, {}};
    image.taken = TakenTime{kNoon + id * kHour, 0};
    return image;
  }

  void Put(const std::vector<ImageRecord>& images) {
    auto transaction = database_->BeginTransaction();
    for (const ImageRecord& image : images) {
      transaction->PutImage(image);
      state_.next_image = std::max(state_.next_image, image.id.value + 1);
    }
    transaction->PutState(state_);
    EXPECT_OK(transaction->Commit());
  }

  FoundPhotos Search(const PhotoSearch& search) {
    auto found = SearchPhotos(*database_->GetSnapshot(), search, &unsure_);
    EXPECT_OK(found);
    return *std::move(found);
  }

  // The ids of all pages.
  std::vector<uint32_t> All(PhotoSearch search) {
    std::vector<uint32_t> ids;
    for (;;) {
      const FoundPhotos page = Search(search);
      EXPECT_LE(page.photos.size(), search.count_max);
      for (const FoundPhoto& photo : page.photos) ids.push_back(photo.id.value);
      if (!page.next_after.valid()) return ids;
      EXPECT_GT(page.next_after, search.after);
      search.after = page.next_after;
    }
  }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_ = MustCreate(folder_ / "db");
  DatabaseState state_;
  UnsureCache unsure_;
};

using Ids = std::vector<uint32_t>;

TEST_F(PhotoSearchTest, ByTime) {
  Put({Photo(1), Photo(2), Photo(3)});
  PhotoSearch search;
  search.taken_from_unix_s = search.taken_to_unix_s = kNoon + 2 * kHour;
  EXPECT_EQ(All(search), (Ids{2}));
  search.taken_to_unix_s.reset();
  EXPECT_EQ(All(search), (Ids{2, 3}));
  search.taken_from_unix_s.reset();
  search.taken_to_unix_s = kNoon + 2 * kHour;
  EXPECT_EQ(All(search), (Ids{1, 2}));
}

TEST_F(PhotoSearchTest, WhatIsNotKnownOfATimeIsNotMadeUp) {
  ImageRecord east = Photo(1), nowhere = Photo(2), silent = Photo(3);
  east.taken->offset_s = 2 * kHour;
  nowhere.taken->offset_s.reset();
  silent.taken.reset();
  Put({east, nowhere, silent});
  const FoundPhotos found = Search({});
  ASSERT_EQ(found.photos.size(), 3u);
  EXPECT_EQ(found.photos[0].taken_from_unix_s, kNoon - kHour);
  EXPECT_EQ(found.photos[0].taken_to_unix_s, kNoon - kHour);
  // Somewhere on the earth it was two past noon.
  EXPECT_EQ(found.photos[1].taken_from_unix_s, kNoon + (2 - 14) * kHour);
  EXPECT_EQ(found.photos[1].taken_to_unix_s, kNoon + (2 + 12) * kHour);
  EXPECT_EQ(found.photos[2].taken_from_unix_s, kTakenUnixSMin);
  EXPECT_EQ(found.photos[2].taken_to_unix_s, silent.time_unix_s);
  PhotoSearch search;
  search.taken_from_unix_s = search.taken_to_unix_s = kNoon + 10 * kHour;
  EXPECT_EQ(All(search), (Ids{2, 3}));
}

TEST_F(PhotoSearchTest, ByPlaceAndByNumber) {
  ImageRecord lost = Photo(2);
  lost.gps.reset();
  Put({Photo(1), lost, Photo(3), Photo(4)});
  PhotoSearch search;
  std::vector<double> asked;
  search.is_there = [&](const GeoPosition& position) {
    asked.push_back(position.longitude_deg);
    return position.longitude_deg > 0.02;
  };
  EXPECT_EQ(All(search), (Ids{3, 4}));
  EXPECT_EQ(asked, (std::vector<double>{0.01, 0.03, 0.04}));
  search.images = {ImageId(4), ImageId(1), ImageId(4), ImageId(99)};
  EXPECT_EQ(All(search), (Ids{4}));
  search.is_there = nullptr;
  EXPECT_EQ(All(search), (Ids{1, 4}));
}

TEST_F(PhotoSearchTest, APoseCountsMoreThanWhatThePhotoSays) {
  Put({Photo(1), Photo(2)});
  auto transaction = database_->BeginTransaction();
  ReconstructionRecord record;
  record.id = ReconstructionId(1);
  record.image_count = 1;
  record.georeference.version = 5;
  record.georeference.place.emplace().origin = {10, 20, 300};
  transaction->PutReconstruction(record);
  transaction->PutPose({ImageId(2), record.id, Rigid3()});
  EXPECT_OK(transaction->Commit());
  const FoundPhotos found = Search({});
  ASSERT_EQ(found.photos.size(), 2u);
  EXPECT_FALSE(found.photos[0].on_earth);
  EXPECT_FALSE(found.photos[0].reconstruction.valid());
  ASSERT_TRUE(found.photos[1].on_earth);
  EXPECT_EQ(found.photos[1].reconstruction, record.id);
  EXPECT_NEAR(found.photos[1].on_earth->position.latitude_deg, 10, 1e-9);
  PhotoSearch search;
  search.is_there = [](const GeoPosition& position) { return position.latitude_deg < 11; };
  EXPECT_EQ(All(search), (Ids{2}));
  const auto extent = ExtentOf(*database_->GetSnapshot(), &unsure_);
  ASSERT_OK(extent);
  EXPECT_NEAR(extent->south_west->latitude_deg, 10, 1e-9);
  EXPECT_EQ(extent->south_west->longitude_deg, 0.01);
  EXPECT_EQ(extent->north_east->latitude_deg, 47);
  EXPECT_EQ(extent->taken_from_unix_s, kNoon + kHour);
  EXPECT_EQ(extent->taken_to_unix_s, kNoon + 2 * kHour);
}

TEST_F(PhotoSearchTest, PagesStandWhilePhotosComeAndGo) {
  for (uint32_t id = 1; id <= 25; ++id) Put({Photo(id)});
  PhotoSearch search;
  search.count_max = 10;
  FoundPhotos page = Search(search);
  EXPECT_EQ(page.photos.size(), 10u);
  EXPECT_EQ(page.next_after, ImageId(10));
  auto transaction = database_->BeginTransaction();
  transaction->RemoveImage(ImageId(5));
  transaction->RemoveImage(ImageId(11));
  EXPECT_OK(transaction->Commit());
  Put({Photo(26)});
  search.after = page.next_after;
  Ids wanted;
  for (uint32_t id = 12; id <= 26; ++id) wanted.push_back(id);
  EXPECT_EQ(All(search), wanted);
}

TEST_F(PhotoSearchTest, RejectedPhotosAreNotFound) {
  ImageRecord rejected = Photo(1);
  rejected.verdict = Verdict::kRejected;
  rejected.reason = Reason::kNoTexture;
  Put({rejected, Photo(2)});
  EXPECT_EQ(All({}), (Ids{2}));
}

// That this thread has worked, whatever else the machine does.
double WorkedMs() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

TEST_F(PhotoSearchTest, TenThousandPhotosAreSearchedInATenthOfASecond) {
  constexpr uint32_t kCount = 10'000;
  std::vector<ImageRecord> images;
  auto transaction = database_->BeginTransaction();
  ReconstructionRecord record;
  record.id = ReconstructionId(1);
  record.image_count = kCount;
  record.georeference.version = 5;
  record.georeference.place.emplace().origin = {10, 20, 300};
  transaction->PutReconstruction(record);
  for (uint32_t id = 1; id <= kCount; ++id) {
    images.push_back(Photo(id));
    transaction->PutPose({ImageId(id), record.id, Rigid3()});
  }
  EXPECT_OK(transaction->Commit());
  Put(images);
  PhotoSearch search;
  search.is_there = [](const GeoPosition&) { return false; };  // all are looked at
  double best_ms = 1e9;
  for (int i = 0; i < 5; ++i) {
    const double begin_ms = WorkedMs();
    EXPECT_FALSE(Search(search).next_after.valid());
    best_ms = std::min(best_ms, WorkedMs() - begin_ms);
  }
  std::printf("%u photos in %.1f ms\n", kCount, best_ms);
#ifdef NDEBUG
  EXPECT_LT(best_ms, 100);
#endif
}

TEST_F(PhotoSearchTest, ASearchLooksAtSoManyPhotosAndGoesOnLater) {
  std::vector<ImageRecord> images;
  for (uint32_t id = 1; id <= kSearchedPhotosMax + 5; ++id) images.push_back(Photo(id));
  Put(images);
  PhotoSearch search;
  search.taken_from_unix_s = kNoon + (kSearchedPhotosMax + 3) * kHour;
  const FoundPhotos first = Search(search);
  EXPECT_TRUE(first.photos.empty());
  EXPECT_EQ(first.next_after, ImageId(kSearchedPhotosMax));
  EXPECT_EQ(All(search),
            (Ids{kSearchedPhotosMax + 3, kSearchedPhotosMax + 4, kSearchedPhotosMax + 5}));
  const auto extent = ExtentOf(*database_->GetSnapshot(), &unsure_);
  ASSERT_OK(extent);
  EXPECT_FALSE(extent->south_west);
}

}  // namespace
}  // namespace veduta
