// SPDX-License-Identifier: Apache-2.0
// Goal: the images whose bytes a larger copy has replaced are those that the journal names.
// Method: a made journal.
#include "engine/query/replaced_images.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(ReplacedImages, AreThoseThatTheJournalNames) {
  const TemporaryFolder folder;
  const auto database = Database::Open(folder / "db", {.create = true, .sync_wal = false});
  ASSERT_OK(database);
  EXPECT_TRUE(ReplacedImages(*(*database)->GetSnapshot())->empty());
  const auto transaction = (*database)->BeginTransaction();
  uint64_t sequence = 0;
  for (const auto& [action, image] :
       {std::pair("add", 1u), {"replace", 7u}, {"remove", 2u}, {"replace", 3u}, {"replace", 7u}}) {
    JournalRecord entry;
    entry.sequence = ++sequence;
    entry.actor = "anna";
    entry.action = action;
    entry.image = ImageId(image);
    transaction->AddJournal(entry);
  }
  ASSERT_OK(transaction->Commit());
  EXPECT_EQ(*ReplacedImages(*(*database)->GetSnapshot()),
            (std::set<ImageId>{ImageId(3), ImageId(7)}));
}

}  // namespace
}  // namespace veduta
