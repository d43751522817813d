// SPDX-License-Identifier: Apache-2.0
// Goal: readers never wait for the writer and never see half a photo.
// Method: one thread adds a walk, with adjustments and a trained vocabulary on the way, while
//   three others ask everything in loops; each snapshot must be sound in itself, and no count
//   may fall. Meant for ThreadSanitizer too.
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "engine/query/ranking.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

// What must hold on any snapshot, and between an earlier one and this one.
void ExpectConsistent(const CityQuestions& ask, StatusAnswer* previous) {
  const auto status = ask.Status();
  ASSERT_OK(status);
  EXPECT_GE(status->images, previous->images);
  EXPECT_GE(status->placed, previous->placed);
  EXPECT_GE(status->snapshot, previous->snapshot);
  EXPECT_GE(status->vocabulary_generation, previous->vocabulary_generation);
  EXPECT_EQ(status->images, status->placed + status->postponed + status->rejected);
  uint64_t in_reconstructions = 0;
  for (const ReconstructionAnswer& one : status->reconstructions) in_reconstructions += one.images;
  EXPECT_EQ(in_reconstructions, status->placed);
  uint64_t images = 0, posed = 0;
  EXPECT_OK(ask.snapshot().ScanImages([&](const ImageRecord& image) {
    ++images;
    const auto pose = ask.Pose(image.id);
    EXPECT_OK(pose);
    posed += pose.ok() && pose->has_value();
    const auto neighbors = ask.Neighbors(image.id);
    EXPECT_OK(neighbors);
    if (!neighbors.ok()) return false;
    for (const PairNeighbor& neighbor : *neighbors)
      EXPECT_OK(ask.snapshot().GetImage(neighbor.image));
    return true;
  }));
  EXPECT_EQ(images, status->images);
  EXPECT_EQ(posed, status->placed);
  *previous = *status;
}

// The snapshot is sound, and its digest does not change under its reader.
void ExpectProven(const CityQuestions& ask) {
  EXPECT_TRUE(IsSound(ask.snapshot()));
  const auto once = DigestOf(ask.snapshot()), twice = DigestOf(ask.snapshot());
  ASSERT_OK(once);
  ASSERT_OK(twice);
  EXPECT_EQ(once->Hex(), twice->Hex()) << "a snapshot changed under its reader";
}

// A new photo can be ranked, and a stored one is ranked first by its own features, on the snapshot
// that they come from.
void ExpectRanked(const City& city, const PhotoSource& fresh, const std::string& stored,
                  size_t count_max, EngineCaches* caches) {
  const CityQuestions ask = city.Ask();
  const auto state = ask.snapshot().GetState();
  ASSERT_OK(state);
  const auto ranked = city.Ask().door().Rank(fresh, "street", 100);
  EXPECT_OK(ranked);
  if (ranked.ok()) {
    EXPECT_LE(ranked->size(), count_max);
  }
  const auto first = ask.snapshot().FindImageByName(stored, "anna");
  ASSERT_OK(first);
  if (!*first) return;  // not added yet
  const auto own = ask.snapshot().GetFeatures(ask.snapshot().GetImage(**first)->photo);
  ASSERT_OK(own);
  const auto found = RankFeatures(ask.snapshot(), *own, 3, &caches->retrieval, &caches->features,
                                  city.parts().pool.get());
  ASSERT_OK(found);
  EXPECT_TRUE(!found->empty() && (*found)[0].image == **first);
  EXPECT_LE(found->size(), state->retrievable_image_count);
}

// A thread that does `body` again and again until the writer is done, and counts how often. Once
// more after the end, so that each has run however fast the writer was.
class Reader final {
 public:
  Reader(const std::atomic<bool>* done, std::function<void()> body)
      : thread_([this, done, body = std::move(body)] {
          for (bool last = false; !last && !testing::Test::HasFailure();) {
            last = *done;
            body();
            ++count_;
          }
        }) {}
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  uint32_t Join() {
    thread_.join();
    return count_;
  }

 private:
  uint32_t count_ = 0;
  std::thread thread_;  // last: it writes the count
};

TEST(Concurrency, ReadersSeeWholePhotosOnly) {
  CityOptions options = City::Options(2);
  options.ingest.schedule.views_step = 3;
  options.ingest.retrieval.compare_all_max = 5;
  options.ingest.retrieval.training_count_max = 2000;
  City city(options);
  const std::vector<Stand> stands = Walk(6, 0.9, 8);
  for (const Stand& stand : stands) TakePhoto(stand);
  const PhotoSubmission query = city.Submit({9.1, 90});
  const std::string& first = TakePhoto(stands[0]).name;

  std::atomic<bool> done = false;
  StatusAnswer previous;
  const std::shared_ptr<EngineCaches> caches = city.parts().GetCaches();
  Reader asks(&done, [&] { ExpectConsistent(city.Ask(), &previous); });
  Reader proves(&done, [&] { ExpectProven(city.Ask()); });
  Reader looks_up(&done,
                  [&] { ExpectRanked(city, query.photo, first, stands.size(), caches.get()); });
  const std::vector<AddOutcome> outcomes = city.Add(stands);
  done = true;
  EXPECT_GT(asks.Join(), 1u);
  EXPECT_GT(proves.Join(), 1u);
  EXPECT_GT(looks_up.Join(), 1u);
  EXPECT_EQ(city.Counts().placed, stands.size()) << Told(outcomes);
  EXPECT_GE(city.Counts().vocabulary_generation, 1u);

  // Readers have changed nothing.
  City alone(options);
  alone.Add(stands);
  EXPECT_EQ(alone.Digest(), city.Digest());
}

TEST(Concurrency, WritersTakeTurns) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 4);
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : stands) photos.push_back(city.Submit(stand));
  std::vector<std::thread> writers;
  std::atomic<size_t> answers = 0;
  for (size_t i = 0; i < photos.size(); ++i) {
    writers.emplace_back([&, i] {
      EXPECT_OK(city.engine().AddPhotos({&photos[i], 1}, [&](const AddOutcome& outcome) {
        EXPECT_TRUE(outcome.id.valid());
        ++answers;
      }));
    });
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(answers, photos.size());
  EXPECT_EQ(city.Counts().images, photos.size());
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

}  // namespace
}  // namespace veduta
