// SPDX-License-Identifier: Apache-2.0
// Goal: whichever write fails while a new vocabulary is written and switched to, the next attempt,
//   with other images, has the words and postings of its own tree and images, and nothing stale.
// Method: every write operation of a switch fails once (tests/storage/fault_file_system.h); then
//   the database is opened again in the same process, or the process dies; images are added and the
//   vocabulary is trained again. What is stored is compared with what the active tree says.
#include <gtest/gtest.h>

#include <map>

#include "engine/retrieval/retrieval.h"
#include "tests/storage/fault_file_system.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

constexpr uint32_t kImagesBefore = 5, kImagesAfter = 8;

void AddImage(Database* database, uint32_t id) {
  Features features = SampleFeatures(id, 40);
  features.descriptors = SampleBytes(100 + id, 40 * kDescriptorSize);
  ASSERT_OK(database->WritePhotoAhead(SampleHash(id), SampleBytes(id, 10), features));
  const auto transaction = database->BeginTransaction();
  DatabaseState state = *transaction->base()->GetState();
  state.next_image = id + 1;
  ++state.retrievable_image_count;
  ImageRecord image = SampleImage(id);
  image.verdict = Verdict::kPostponed;
  transaction->PutImage(image);
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
}

Status Switch(Database* database, ThreadPool* pool) {
  RetrievalOptions options;
  options.training_count_max = 60;  // a word is a write
  Retrieval retrieval(options);
  VEDUTA_ASSIGN_OR_RETURN(Retrieval::Prepared prepared, retrieval.Train(database, pool));
  return retrieval.Activate(database, std::move(prepared));
}

// Words and postings of the active generation are those of its tree and of all images, and there is
// no other generation.
void ExpectNothingStale(const Snapshot& snapshot) {
  const uint32_t active = snapshot.GetState()->vocabulary_generation;
  const auto stored = snapshot.GetVocabulary(active);
  ASSERT_OK(stored);
  const auto tree = VocabularyTree::Parse(stored->bytes());
  ASSERT_OK(tree);
  std::map<WordId, std::vector<ImageId>> expected, found;
  for (uint32_t id = 1; id <= kImagesAfter; ++id) {
    const Features features = *snapshot.GetFeatures(SampleHash(id));
    const std::vector<WordId> words = DistinctWords(tree->QuantizeAll(features.descriptors));
    EXPECT_EQ(*snapshot.GetWords(active, ImageId(id)), words);
    for (const WordId word : words) expected[word].push_back(ImageId(id));
  }
  EXPECT_OK(snapshot.ScanPostings(active, [&](WordId word, std::span<const ImageId> images) {
    found[word].assign(images.begin(), images.end());
    return true;
  }));
  EXPECT_EQ(found, expected);
  for (uint32_t other = 1; other <= 4; ++other) {
    EXPECT_EQ(snapshot.GetVocabulary(other).ok(), other == active) << other;
  }
}

// Whether the n-th write lies within the switch.
bool Survives(uint64_t n, bool process_dies) {
  const TemporaryFolder folder;
  ThreadPool pool(1);
  const auto disk = std::make_shared<FaultFileSystem>();
  const DatabaseOptions options{.file_system = disk};
  auto database = MustCreate(folder / "db", options);
  for (uint32_t id = 1; id <= kImagesBefore; ++id) AddImage(database.get(), id);
  disk->FailWrites(n, Fault::kIoError, 1);
  const Status switched = Switch(database.get(), &pool);
  const bool reached = disk->fault_count() > 0;
  EXPECT_EQ(switched.ok(), !reached) << switched.message();
  disk->Heal();
  if (process_dies) {
    database.reset();
    database = MustOpen(folder / "db", options);
  } else {
    EXPECT_OK(database->Reopen());
  }
  for (uint32_t id = kImagesBefore + 1; id <= kImagesAfter; ++id) AddImage(database.get(), id);
  EXPECT_OK(Switch(database.get(), &pool));
  ExpectNothingStale(*database->GetSnapshot());
  return reached;
}

TEST(VocabularyFaults, ASwitchThatFailedLeavesNothingForTheNext) {
  for (const bool process_dies : {false, true}) {
    uint64_t n = 1;
    for (; !testing::Test::HasFailure() && Survives(n, process_dies); ++n) {
    }
    std::cout << n - 1 << " writes failed\n";
    EXPECT_GT(n, 40u) << "the switch has hardly written anything";
  }
}

// A failure that is not a write's: the process goes on, and nothing is left before the next switch.
TEST(VocabularyFaults, APreparationThatIsGivenUpLeavesNothing) {
  const TemporaryFolder folder;
  ThreadPool pool(1);
  const auto database = MustCreate(folder / "db", {});
  for (uint32_t id = 1; id <= kImagesAfter; ++id) AddImage(database.get(), id);
  Retrieval retrieval({});
  { ASSERT_OK(retrieval.Train(database.get(), &pool)); }
  const auto snapshot = database->GetSnapshot();
  EXPECT_FALSE(snapshot->GetVocabulary(1).ok());
  EXPECT_FALSE(snapshot->GetWords(1, ImageId(1)).ok());
  size_t count = 0;
  EXPECT_OK(snapshot->ScanPostings(1, [&](WordId, auto) { return ++count, true; }));
  EXPECT_EQ(count, 0u);
}

}  // namespace
}  // namespace veduta
