// SPDX-License-Identifier: Apache-2.0
// Goal: the same photos in the same order give the same database to the last bit, whatever the
//   number of threads, the sizes of the caches and the number of processes that it took.
// Method: one short history with everything in it (founding, propagation, merge, adjustment of
//   the whole, a trained vocabulary, rejections, duplicates) is run under each of these
//   conditions; the digests are compared.
#include <gtest/gtest.h>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

CityOptions EventfulOptions(uint32_t thread_count) {
  CityOptions options = City::Options(thread_count);
  options.ingest.schedule.views_step = 4;        // all is adjusted within these few photos
  options.ingest.retrieval.compare_all_max = 6;  // and a vocabulary trained, twice
  options.ingest.retrieval.retrain_factor = 2;
  options.ingest.retrieval.training_count_max = 3000;
  return options;
}

std::vector<PhotoSubmission> EventfulPhotos(City* city) {
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : {Stand{6, 90}, {11, 90}, {16, 90}, {8.5, 90}})
    photos.push_back(city->Submit(stand));
  photos.push_back(city->Submit("broken.jpg", {1, 2, 3}));
  for (const Stand& stand : {Stand{20.5, 90}, {22, 95}, {23.5, 85}, {13.5, 90}})
    photos.push_back(city->Submit(stand));
  photos.push_back(city->Submit("again.jpg", TakePhoto({6, 90}).jpeg));
  for (const Stand& stand : {Stand{18, 90}, {19.2, 90}, {14.8, 90}})
    photos.push_back(city->Submit(stand));
  return photos;
}

// The journal without times: what was done in which order.
std::string JournalOf(const City& city) {
  std::string text;
  EXPECT_OK(city.Ask().snapshot().ScanJournal(1, [&](const JournalRecord& r) {
    text += std::to_string(r.sequence) + " " + r.action + " " + std::to_string(r.image.value) +
            " " + r.detail + "\n";
    return true;
  }));
  return text;
}

class Determinism : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    City city(EventfulOptions(1));
    city.Add(EventfulPhotos(&city));
    digest_ = city.Digest();
    journal_ = JournalOf(city);
    EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  }
  static void ExpectSame(const City& city) {
    EXPECT_EQ(JournalOf(city), journal_);
    EXPECT_EQ(city.Digest(), digest_);
  }
  static inline std::string digest_, journal_;
};

TEST_F(Determinism, TheHistoryIsEventful) {
  for (const char* event : {"founded", "propagate", "adjust", "merge", "vocabulary", "rejected"}) {
    EXPECT_NE(journal_.find(event), std::string::npos) << event << " did not happen:\n" << journal_;
  }
}

TEST_F(Determinism, ThreadsDoNotMatter) {
  for (const uint32_t threads : {2u, 4u}) {
    SCOPED_TRACE(std::to_string(threads) + " threads");
    City city(EventfulOptions(threads));
    city.Add(EventfulPhotos(&city));
    ExpectSame(city);
  }
}

TEST_F(Determinism, AProcessAPhotoIsTheSame) {
  City city(EventfulOptions(2));
  const std::vector<PhotoSubmission> photos = EventfulPhotos(&city);
  for (const PhotoSubmission& photo : photos) {
    city.Add({photo});
    city.Reopen();
  }
  ExpectSame(city);
}

TEST_F(Determinism, CachesDoNotMatter) {
  CityOptions options = EventfulOptions(2);
  options.ingest.map_images_max = 1;
  options.ingest.feature_cache_bytes = 1;
  options.undistort_cache_bytes = 1;
  City city(options);
  city.Add(EventfulPhotos(&city));
  ExpectSame(city);
}

// The heap's layout must not show, as it would where things are ordered by their addresses.
TEST_F(Determinism, TheHeapDoesNotMatter) {
  City city(EventfulOptions(1));
  const std::vector<PhotoSubmission> photos = EventfulPhotos(&city);
  SeededRandom random(3);
  std::vector<std::unique_ptr<char[]>> clutter(4000);
  for (const PhotoSubmission& photo : photos) {
    for (int i = 0; i < 20'000; ++i)
      clutter[random.Below(4000)] = std::make_unique<char[]>(16 + random.Below(600));
    city.Add({photo});
  }
  ExpectSame(city);
}

}  // namespace
}  // namespace veduta
