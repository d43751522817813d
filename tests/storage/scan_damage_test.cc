// SPDX-License-Identifier: Apache-2.0
// Goal: a table that cannot be read is named by every scan of its family, and neither passed over
//   nor a crash; also where ranges of keys were deleted, and while there are other tables.
// Method: two tables in each family, which recovery makes of the log; each table of a family is
//   damaged in turn, at its begin, its middle and its end. (Found by bad_days_test.cc.)
#include <gtest/gtest.h>

#include <filesystem>

#include "log_damage.h"
#include "modeled_city.h"

namespace veduta {
namespace {

constexpr uint32_t kGenerations = 3;

// Each generation of the vocabulary and of the points deletes the one before as a range.
Status PutGeneration(Database* database, uint32_t generation) {
  VEDUTA_RETURN_IF_ERROR(AddImage(*database, generation));
  const auto transaction = database->BeginTransaction();
  const ImageId image(generation);
  for (WordId word = 0; word < 12; ++word)
    transaction->AddPostings(generation, std::vector<WordId>{word}, image);
  transaction->PutWords(generation, image, std::vector<WordId>{1, 2});
  transaction->PutPointBlock(ReconstructionId(1), generation, SampleBlock(generation, 5));
  transaction->DeleteVocabulary(generation - 1);
  transaction->DeletePointBlocks(ReconstructionId(1), generation - 1);
  transaction->AddJournal({generation, 0, "anna", "add", image, {}, ""});
  return transaction->Commit();
}

TEST(ScanDamage, NoTableIsPassedOver) {
  const TemporaryFolder folder;
  const std::string path = folder / "db";
  MustCreate(path).reset();
  Records whole;
  for (uint32_t generation = 1; generation <= kGenerations; ++generation) {
    const auto database = MustOpen(path, {});  // makes a table of what was in the log
    ASSERT_OK(PutGeneration(database.get(), generation));
    ASSERT_OK(ReadAll(*database->GetSnapshot(), &(whole = Records())));
  }
  MustOpen(path, {}).reset();
  size_t named = 0;
  for (const auto& file : std::filesystem::directory_iterator(path)) {
    if (file.path().extension() != ".sst") continue;
    for (const uint64_t byte : {uint64_t{4}, file.file_size() / 3, file.file_size() / 2}) {
      FlipBit(file.path(), byte);
      const auto opened = Database::Open(path, {.read_only = true});
      Records stored;
      const Status status =
          opened.ok() ? ReadAll(*(*opened)->GetSnapshot(), &stored) : opened.status();
      named += status.code() == StatusCode::kCorruption ? 1 : 0;
      if (status.ok()) {
        EXPECT_EQ(DifferenceOf(whole, stored), "")
            << "silent: byte " << byte << " of " << file.path().filename();
      }
      FlipBit(file.path(), byte);
    }
  }
  EXPECT_GT(named, 40u);
}

}  // namespace
}  // namespace veduta
