// SPDX-License-Identifier: Apache-2.0
// Goal: entries of the journal are numbered without a gap across transactions, carry the time, and
//   an entry whose transaction is not committed leaves no number used.
// Method: a database in a temporary folder; what is appended is read back by a scan.
#include "engine/journal/journal.h"

#include <gtest/gtest.h>

#include <ctime>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

std::vector<JournalRecord> ReadJournal(const Database& database) {
  std::vector<JournalRecord> entries;
  EXPECT_TRUE(database.GetSnapshot()
                  ->ScanJournal(1,
                                [&](const JournalRecord& entry) {
                                  entries.push_back(entry);
                                  return true;
                                })
                  .ok());
  return entries;
}

TEST(Journal, NumbersEntriesFromTheState) {
  const TemporaryFolder folder;
  const auto opened = Database::Open(folder / "db", {.create = true});
  ASSERT_TRUE(opened.ok()) << opened.status().message();
  Database& database = **opened;
  const auto append = [&](const std::vector<std::string>& details, bool commit) {
    const std::unique_ptr<Transaction> transaction = database.BeginTransaction();
    DatabaseState state = *database.GetSnapshot()->GetState();
    for (const std::string& detail : details) {
      AppendJournal({77, 88, "anna", "add", ImageId(3), ReconstructionId(4), detail}, &state,
                    transaction.get());
    }
    transaction->PutState(state);
    if (commit) {
      EXPECT_TRUE(transaction->Commit().ok());
    }
  };
  const int64_t before = std::time(nullptr);
  append({"one", "two"}, true);
  append({"never committed"}, false);
  append({"three"}, true);
  const std::vector<JournalRecord> entries = ReadJournal(database);
  ASSERT_EQ(entries.size(), 3u);
  for (size_t i = 0; i < entries.size(); ++i) {
    EXPECT_EQ(entries[i].sequence, i + 1);
    EXPECT_GE(entries[i].time_unix_s, before);
    EXPECT_LE(entries[i].time_unix_s, std::time(nullptr));
    EXPECT_EQ(entries[i].actor, "anna");
    EXPECT_EQ(entries[i].action, "add");
    EXPECT_EQ(entries[i].image, ImageId(3));
    EXPECT_EQ(entries[i].reconstruction, ReconstructionId(4));
  }
  EXPECT_EQ(entries[2].detail, "three");
  EXPECT_EQ(database.GetSnapshot()->GetState()->next_journal, 4u);
}

}  // namespace
}  // namespace veduta
