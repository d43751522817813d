// SPDX-License-Identifier: Apache-2.0
// Goal: the engine's own vocabulary comes when the options say, switches at once and as a
//   whole, is the same on any number of threads, and finds what brute force finds.
// Method: a city whose photos are synthetic descriptors, written straight into the database:
//   sites of several images, each seeing some of its site's spots with noise. Every generation
//   is looked at from before and after its switch; brute force compares every descriptor with
//   all of every image.
#include "engine/retrieval/retrieval.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "tests/index/synthetic_descriptors.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

constexpr uint32_t kSiteCount = 10, kImagesOfSite = 4, kImageCount = kSiteCount * kImagesOfSite;
constexpr int kNoise = 12;

// Neighbours at a site share 30 of their 45 spots; clutter is everyone's own.
std::vector<Features> MakePhotos() {
  SeededRandom random(5);
  std::vector<Features> photos;
  for (uint32_t site = 0; site < kSiteCount; ++site) {
    const std::vector<uint8_t> spots = RandomDescriptors(90, MixSeed(6, site));
    for (size_t i = 0; i < kImagesOfSite; ++i) {
      Features photo = SampleFeatures(photos.size(), 105);
      photo.descriptors.clear();
      for (size_t spot = 15 * i; spot < 15 * i + 45; ++spot) {
        Append(&photo.descriptors, SeenAgain(&spots[spot * kCenterSize], kNoise, random));
      }
      for (int j = 0; j < 60; ++j) Append(&photo.descriptors, RandomDescriptor(random));
      photos.push_back(std::move(photo));
    }
  }
  return photos;
}

RetrievalOptions ScheduledOptions() {
  RetrievalOptions options;
  options.compare_all_max = 6;
  options.retrain_factor = 3;
  options.candidate_count_min = 4;
  options.training_count_max = 2500;
  return options;
}

class PhotoCity {
 public:
  explicit PhotoCity(uint32_t thread_count = 2,
                     const RetrievalOptions& options = ScheduledOptions())
      : retrieval_(options), pool_(thread_count - 1) {
    Create();
  }
  void Create() {
    DatabaseOptions options;
    options.create = true;
    options.sync_wal = false;
    database_ = std::move(*Database::Open(folder_ / "db", options));
  }

  // As the ingest does: the image with its words in one commit, then a vocabulary if one is due.
  void AddNext() {
    AddAs(ImageId(++count_));
    const bool is_due = retrieval_.IsTrainingDue(State());
    auto prepared = retrieval_.TrainIfDue(database_.get(), &pool_);
    ASSERT_OK(prepared);
    ASSERT_EQ(prepared->has_value(), is_due);
    if (!is_due) return;
    ASSERT_OK(Activate(std::move(**prepared)));
  }
  void AddAs(ImageId id) {
    const Features& features = PhotoOf(id);
    ASSERT_OK(
        database_->WritePhotoAhead(SampleHash(id.value), SampleBytes(id.value, 10), features));
    const auto transaction = database_->BeginTransaction();
    DatabaseState state = *transaction->base()->GetState();
    state.next_image = std::max(state.next_image, id.value + 1);
    ImageRecord image = SampleImage(id.value);
    image.verdict = Verdict::kPostponed;
    ++state.retrievable_image_count;
    if (state.vocabulary_generation != 0) {
      const auto words = retrieval_.Words(*transaction->base(), features);
      ASSERT_OK(words);
      transaction->PutWords(state.vocabulary_generation, id, *words);
      transaction->AddPostings(state.vocabulary_generation, *words, id);
    }
    transaction->PutImage(image);
    transaction->PutState(state);
    ASSERT_OK(transaction->Commit());
  }
  // The next image is one that was rejected.
  void Reject() {
    ImageRecord image = SampleImage(++count_);
    image.verdict = Verdict::kRejected;
    image.reason = Reason::kNoTexture;
    const auto transaction = database_->BeginTransaction();
    transaction->PutImage(image);
    ASSERT_OK(transaction->Commit());
  }
  Result<Retrieval::Prepared> Train(const VocabularyRequest& request = {},
                                    const std::stop_token& stop = {}) {
    return retrieval_.Train(database_.get(), &pool_, request, stop);
  }
  Status Activate(Retrieval::Prepared prepared) {
    return retrieval_.Activate(database_.get(), std::move(prepared));
  }
  void AddUntil(size_t count) {
    while (count_ < count && !testing::Test::HasFailure()) AddNext();
  }

  // Sites take turns. The image need not be added yet.
  const Features& PhotoOf(ImageId id) const {
    const uint32_t i = id.value - 1;
    return photos_[i % kSiteCount * kImagesOfSite + i / kSiteCount];
  }
  uint32_t count() const { return count_; }
  std::shared_ptr<const Snapshot> Look() const { return database_->GetSnapshot(); }
  Status Import(const VocabularyTree& tree) {
    VEDUTA_ASSIGN_OR_RETURN(Retrieval::Prepared prepared,
                            retrieval_.Import(database_.get(), tree, &pool_));
    return Activate(std::move(prepared));
  }
  std::vector<WordId> Words(const Snapshot& snapshot, ImageId image) {
    auto words = retrieval_.Words(snapshot, PhotoOf(image));
    EXPECT_OK(words);
    return words.ok() ? *words : std::vector<WordId>();
  }
  std::shared_ptr<const VocabularyTree> Tree(const Snapshot& snapshot) {
    return *retrieval_.ActiveTree(snapshot);
  }
  DatabaseState State() const { return *database_->GetSnapshot()->GetState(); }
  std::vector<RankedImage> Candidates(const Snapshot& snapshot, ImageId query) {
    auto candidates = retrieval_.Candidates(snapshot, PhotoOf(query));
    EXPECT_OK(candidates);
    return candidates.ok() ? *candidates : std::vector<RankedImage>();
  }

  struct Vote {
    ImageId image;
    int shown = 0;  // of the query's descriptors
  };
  // The stored image that shows most of the query.
  Vote BruteForceBest(ImageId query) const {
    Vote best;
    const std::vector<uint8_t>& wanted = PhotoOf(query).descriptors;
    for (uint32_t id = 1; id <= count_; ++id) {
      int shown = 0;
      for (size_t row = 0; row < wanted.size(); row += kCenterSize)
        shown += Shows(PhotoOf(ImageId(id)), &wanted[row]);
      if (shown > best.shown) best = {ImageId(id), shown};
    }
    return best;
  }

 private:
  static bool Shows(const Features& photo, const uint8_t* descriptor) {
    constexpr int kSameSpot =
        2 * 2 * kCenterSize * kNoise * (kNoise + 1) / 3;  // twice what the noise makes of it
    for (size_t row = 0; row < photo.descriptors.size(); row += kCenterSize) {
      const int distance =
          std::transform_reduce(descriptor, descriptor + kCenterSize, &photo.descriptors[row], 0,
                                std::plus<>(), [](int a, int b) { return (a - b) * (a - b); });
      if (distance < kSameSpot) return true;
    }
    return false;
  }

  const TemporaryFolder folder_;
  const std::vector<Features> photos_ = MakePhotos();
  std::unique_ptr<Database> database_;
  Retrieval retrieval_;
  ThreadPool pool_;
  uint32_t count_ = 0;  // images added
};

TEST(EngineRetrieval, AYoungDatabaseComparesAll) {
  PhotoCity city;
  city.AddUntil(5);
  EXPECT_EQ(city.State().vocabulary_generation, 0u);
  const std::vector<RankedImage> all = city.Candidates(*city.Look(), ImageId(2));
  std::vector<RankedImage> newest_first;
  for (uint32_t id = 5; id >= 1; --id) newest_first.push_back({ImageId(id), 0});
  EXPECT_EQ(all, newest_first);
  EXPECT_TRUE(city.Words(*city.Look(), ImageId(1)).empty());
}

TEST(EngineRetrieval, TrainsWhenTheOptionsSay) {
  PhotoCity city;
  std::vector<uint32_t> images_at_switch;
  uint32_t generation = 0;
  while (city.count() < kImageCount) {
    city.AddNext();
    ASSERT_FALSE(testing::Test::HasFailure());
    if (city.State().vocabulary_generation == generation) continue;
    generation = city.State().vocabulary_generation;
    images_at_switch.push_back(city.State().images_at_vocabulary);
    EXPECT_EQ(city.State().images_at_vocabulary, city.count());
  }
  EXPECT_EQ(images_at_switch, (std::vector<uint32_t>{
                                  6, 18}));  // compare_all_max, and thrice that; 54 are never there
}

TEST(EngineRetrieval, AnImportedVocabularyStays) {
  PhotoCity city;
  city.AddUntil(6);
  ASSERT_OK(city.Import(*city.Tree(*city.Look())));
  city.AddUntil(20);
  EXPECT_EQ(city.State().vocabulary_generation, 2u);
  EXPECT_TRUE(city.State().vocabulary_imported);
}

TEST(EngineRetrieval, AGenerationSwitchesAsAWhole) {
  PhotoCity city;
  city.AddUntil(17);
  const auto before = city.Look();
  const std::vector<RankedImage> ranked_before = city.Candidates(*before, ImageId(3));
  city.AddUntil(18);
  const auto after = city.Look();
  ASSERT_EQ(after->GetState()->vocabulary_generation, 2u);
  // A reader of the old state still has the old vocabulary, whole; also once the new one has been
  // in use.
  city.Candidates(*after, ImageId(3));
  EXPECT_EQ(city.Candidates(*before, ImageId(3)), ranked_before);
  // A reader of the new state finds nothing of the old one, and all images in the new one.
  EXPECT_FALSE(after->GetVocabulary(1).ok());
  for (uint32_t id = 1; id <= 18; ++id) {
    EXPECT_EQ(after->GetWords(1, ImageId(id)).status().code(), StatusCode::kNotFound);
    EXPECT_EQ(*after->GetWords(2, ImageId(id)), city.Words(*after, ImageId(id)));
  }
  size_t old_lists = 0, new_entries = 0, words = 0;
  EXPECT_OK(
      after->ScanPostings(1, [&](WordId, std::span<const ImageId>) { return ++old_lists, true; }));
  EXPECT_OK(after->ScanPostings(
      2, [&](WordId, std::span<const ImageId> list) { return new_entries += list.size(); }));
  for (uint32_t id = 1; id <= 18; ++id) words += after->GetWords(2, ImageId(id))->size();
  EXPECT_EQ(old_lists, 0u);
  EXPECT_EQ(new_entries, words);
}

// A rejected photo's number is given to the next photo of its name. Where that one comes while a
// vocabulary is prepared, its number is lower than those of images that have words already.
TEST(EngineRetrieval, ALateImageWithAnEarlyNumberGetsWords) {
  PhotoCity city;
  city.AddUntil(2);
  city.Reject();
  city.AddUntil(5);
  auto prepared = city.Train();
  ASSERT_OK(prepared);
  city.AddAs(ImageId(3));
  ASSERT_OK(city.Activate(std::move(*prepared)));
  EXPECT_EQ(*city.Look()->GetWords(1, ImageId(3)), city.Words(*city.Look(), ImageId(3)));
  EXPECT_EQ(city.State().images_at_vocabulary, 5u);
}

TEST(EngineRetrieval, ThreadsDoNotMatter) {
  PhotoCity alone(1), crowd(4);
  alone.AddUntil(20);
  crowd.AddUntil(20);
  const auto one = alone.Look(), four = crowd.Look();
  ASSERT_EQ(alone.State(), crowd.State());
  EXPECT_TRUE(std::ranges::equal(one->GetVocabulary(2)->bytes(), four->GetVocabulary(2)->bytes()));
  for (uint32_t id = 1; id <= 20; ++id) {
    EXPECT_EQ(*one->GetWords(2, ImageId(id)), *four->GetWords(2, ImageId(id)));
    EXPECT_EQ(alone.Candidates(*one, ImageId(id)), crowd.Candidates(*four, ImageId(id)));
  }
}

// As the ingest asks: for a photo that is not stored yet, with the vocabulary of the day.
TEST(EngineRetrieval, FindsWhatBruteForceFinds) {
  PhotoCity city;
  city.AddUntil(6);
  int found = 0, wanted = 0;
  for (; city.count() < kImageCount && !testing::Test::HasFailure(); city.AddNext()) {
    const ImageId next(city.count() + 1);
    const PhotoCity::Vote best = city.BruteForceBest(next);
    if (best.shown < 20) continue;  // the first of its site
    const std::vector<RankedImage> candidates = city.Candidates(*city.Look(), next);
    ASSERT_EQ(candidates.size(), ScheduledOptions().candidate_count_min);
    ++wanted;
    found += std::ranges::any_of(candidates,
                                 [&](const RankedImage& c) { return c.image == best.image; });
  }
  std::cout << "recall " << found << " of " << wanted << "\n";
  EXPECT_EQ(wanted, static_cast<int>(kImageCount - kSiteCount));
  EXPECT_GE(found, 0.95 * wanted);
}

TEST(EngineRetrieval, CandidatesAreBounded) {
  RetrievalOptions options = ScheduledOptions();
  options.training_count_max = 50;  // so few words that all images share some
  options.candidate_count_min = 2;
  options.candidate_share = 0.2;
  options.candidate_count_max = 5;
  PhotoCity city(2, options);
  std::map<uint32_t, size_t> counts;
  for (const uint32_t size : {7u, 18u, kImageCount}) {
    city.AddUntil(size);
    counts[size] = city.Candidates(*city.Look(), ImageId(1)).size();
  }
  EXPECT_EQ(counts, (std::map<uint32_t, size_t>{{7, 2}, {18, 4}, {kImageCount, 5}}));
}

TEST(EngineRetrieval, BoundsOfItsOptionsAreNoticed) {
  EXPECT_OK(RetrievalOptions().Check());
  RetrievalOptions options;
  options.candidate_count_max = options.candidate_count_min;
  EXPECT_OK(options.Check());
  options.candidate_count_max = 23;
  EXPECT_EQ(options.Check().message(), "candidate_count_max is 23, but must be 24 or more");
  options = {};
  options.gathered_words_max = 0;
  EXPECT_EQ(options.Check().message(), "gathered_words_max is 0, but must be 1 or more");
}

TEST(EngineRetrieval, ListsThatAreWrittenInPiecesAreTheSame) {
  RetrievalOptions options = ScheduledOptions();
  options.training_count_max = 200;  // so that images share words
  PhotoCity whole(2, options);
  options.gathered_words_max = 150;  // of some 80 for each photo
  PhotoCity pieces(2, options);
  using Lists = std::map<WordId, std::vector<ImageId>>;
  const auto lists_of = [](PhotoCity& city) {
    city.AddUntil(18);
    Lists lists;
    EXPECT_OK(city.Look()->ScanPostings(2, [&](WordId word, std::span<const ImageId> images) {
      lists[word].assign(images.begin(), images.end());
      return true;
    }));
    return lists;
  };
  const Lists expected = lists_of(whole);
  EXPECT_TRUE(
      std::ranges::any_of(expected, [](const auto& list) { return list.second.size() > 2; }));
  EXPECT_EQ(lists_of(pieces), expected);
}

TEST(EngineRetrieval, TrainsTheShapeThatIsAskedFor) {
  PhotoCity city;
  city.AddUntil(18);
  auto prepared = city.Train({.branch = 4, .levels = 3, .sample = 1500});
  ASSERT_OK(prepared);
  EXPECT_EQ(prepared->info.branch, 4u);
  EXPECT_EQ(prepared->info.depth, 3u);
  EXPECT_EQ(prepared->info.training_size, 1500u);
  EXPECT_GT(prepared->info.leaf_count, 32u);
  EXPECT_LE(prepared->info.leaf_count, 64u);
  ASSERT_OK(city.Activate(std::move(*prepared)));
  EXPECT_EQ(city.Candidates(*city.Look(), ImageId(3)).at(0), (RankedImage{ImageId(3), 1.0}));
}

TEST(EngineRetrieval, TrainingThatIsStoppedChangesNothing) {
  PhotoCity city;
  city.AddUntil(5);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(city.Train({}, stop.get_token()).status().code(), StatusCode::kCancelled);
  EXPECT_EQ(city.State().vocabulary_generation, 0u);
  EXPECT_OK(city.Train());
}

TEST(EngineRetrieval, RefusesAShapeOutsideItsBounds) {
  PhotoCity city;
  city.AddUntil(5);
  const auto message = [&](const VocabularyRequest& request) {
    const auto prepared = city.Train(request);
    EXPECT_EQ(prepared.status().code(), StatusCode::kInvalidArgument);
    return prepared.status().message();
  };
  EXPECT_EQ(message({.branch = 1}), "VocabularyRequest.branch is 1, but must be from 2 to 64");
  EXPECT_EQ(message({.branch = 65}), "VocabularyRequest.branch is 65, but must be from 2 to 64");
  EXPECT_EQ(message({.levels = 0}), "VocabularyRequest.levels is 0, but must be from 1 to 7");
  EXPECT_EQ(message({.levels = 8}), "VocabularyRequest.levels is 8, but must be from 1 to 7");
  EXPECT_EQ(message({.sample = 999}),
            "VocabularyRequest.sample is 999, but must be from 1000 to 16777216");
  EXPECT_EQ(message({.sample = 16'777'217}),
            "VocabularyRequest.sample is 16777217, but must be from 1000 to 16777216");
}

TEST(EngineRetrieval, AStoredImageIsMostLikeItself) {
  PhotoCity city;
  city.AddUntil(kImageCount);
  for (uint32_t id = 1; id <= kImageCount; ++id) {
    EXPECT_EQ(city.Candidates(*city.Look(), ImageId(id)).at(0), (RankedImage{ImageId(id), 1.0}));
  }
}

}  // namespace
}  // namespace veduta
