// SPDX-License-Identifier: Apache-2.0
// Goal: readers never wait for the writer and never see half a photo.
// Method: one thread adds a walk, with adjustments and a trained vocabulary on the way, while
//   three others ask everything in loops; each snapshot must be sound in itself, and no count
//   may fall. Meant for ThreadSanitizer too.
#include <gtest/gtest.h>

#include <atomic>
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

TEST(Concurrency, ReadersSeeWholePhotosOnly) {
  CityOptions options = City::Options(2);
  options.ingest.schedule.views_step = 3;
  options.ingest.retrieval.compare_all_max = 5;
  options.ingest.retrieval.training_count_max = 2000;
  City city(options);
  const std::vector<Stand> stands = Walk(6, 0.9, 8);
  for (const Stand& stand : stands) TakePhoto(stand);
  const PhotoSubmission query = city.Submit({9.1, 90});

  std::atomic<bool> done = false;
  std::atomic<uint32_t> looks = 0, proofs = 0, ranks = 0;
  const auto until_done = [&done](const auto& body) {
    // Once more after the end, so that each has run however fast the writer was.
    for (bool last = false; !last && !testing::Test::HasFailure();) {
      last = done;
      body();
    }
  };
  std::thread asks([&] {
    StatusAnswer previous;
    until_done([&] {
      ExpectConsistent(city.Ask(), &previous);
      ++looks;
    });
  });
  std::thread proves([&] {
    until_done([&] {
      const CityQuestions ask = city.Ask();
      EXPECT_TRUE(IsSound(ask.snapshot()));
      const auto once = DigestOf(ask.snapshot()), twice = DigestOf(ask.snapshot());
      EXPECT_OK(once);
      EXPECT_EQ(once->Hex(), twice->Hex()) << "a snapshot changed under its reader";
      ++proofs;
    });
  });
  std::thread looks_up([&] {
    const std::shared_ptr<EngineCaches> caches = city.parts().GetCaches();
    Features features;
    until_done([&] {
      const CityQuestions ask = city.Ask();
      const auto state = ask.snapshot().GetState();
      EXPECT_OK(state);
      const auto ranked = city.engine().Ask().Rank(query.photo, "street", 100);
      EXPECT_OK(ranked);
      if (ranked.ok()) {
        EXPECT_LE(ranked->size(), stands.size());
      }
      // A stored photo's own features, on the snapshot that they come from.
      const auto first = ask.snapshot().FindImageByName(TakePhoto(stands[0]).name);
      EXPECT_OK(first);
      if (first.ok() && *first) {
        const auto own = ask.snapshot().GetFeatures(ask.snapshot().GetImage(**first)->photo);
        EXPECT_OK(own);
        const auto found = RankFeatures(ask.snapshot(), *own, 3, &caches->retrieval,
                                        &caches->features, city.parts().pool.get());
        EXPECT_OK(found);
        EXPECT_TRUE(found.ok() && !found->empty() && (*found)[0].image == **first);
        EXPECT_LE(found->size(), state->retrievable_image_count);
      }
      ++ranks;
    });
  });
  const std::vector<AddOutcome> outcomes = city.Add(stands);
  done = true;
  asks.join();
  proves.join();
  looks_up.join();
  EXPECT_EQ(city.Counts().placed, stands.size()) << Told(outcomes);
  EXPECT_GE(city.Counts().vocabulary_generation, 1u);
  EXPECT_GT(looks, 1u);
  EXPECT_GT(proofs, 1u);
  EXPECT_GT(ranks, 1u);

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
