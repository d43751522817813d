// SPDX-License-Identifier: Apache-2.0
// Goal: the counts in the state are those of the records, whatever a transaction puts and in
//   whatever order; a database whose state has none gets them once, also when that is interrupted
//   at any write; a reader counts by itself.
// Method: random transactions against a walk over all records; a state as the program before the
//   counts encoded it, byte by byte; every write of the upgrade failing, with the power cut.
#include "storage/record_counts.h"
#include "storage/records/state_record.h"

#include <gtest/gtest.h>

#include "damage.h"
#include "fault_file_system.h"
#include "samples.h"

namespace veduta {
namespace {

constexpr Verdict kVerdicts[] = {Verdict::kPlaced, Verdict::kMerged, Verdict::kFounded,
                                 Verdict::kPostponed, Verdict::kRejected};

ImageRecord ImageWith(uint32_t id, Verdict verdict) {
  ImageRecord image = SampleImage(id);
  image.verdict = verdict;
  return image;
}

// SampleState(3) as it was encoded before the state had counts.
std::string StateWithoutCounts() {
  static constexpr char kHex[] =
      "000000000a0000000000000006000100030000000100000001000000000000000310a5d4e8000000"
      "010000000000000007000000010000000500000000000000010000006200000003000000010000000400000000"
      "000000";
  std::string bytes;
  for (size_t i = 0; i + 1 < sizeof(kHex); i += 2)
    bytes.push_back(static_cast<char>(std::stoi(std::string(kHex + i, 2), nullptr, 16)));
  return bytes;
}

void WriteOldState(const std::string& path) {
  WithRocksdb(
      path,
      [](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* meta) {
        ASSERT_TRUE(
            db.Put(rocksdb::WriteOptions(), meta, std::string(kStateKey), StateWithoutCounts())
                .ok());
      },
      Family::kMeta);
}

// Five images of all verdicts and two cameras, with a state that has no counts.
void MakeOldDatabase(const std::string& path) {
  auto database = MustCreate(path);
  auto transaction = database->BeginTransaction();
  for (uint32_t id = 1; id <= 5; ++id) transaction->PutImage(ImageWith(id, kVerdicts[id - 1]));
  for (uint32_t id = 1; id <= 2; ++id) transaction->PutCamera({CameraId(id), "c", {}, ""});
  ASSERT_OK(transaction->Commit());
  transaction.reset();
  database.reset();
  WriteOldState(path);
}
constexpr DatabaseCounts kOldCounts = {
    .images = 5, .placed = 3, .postponed = 1, .rejected = 1, .cameras = 2};

TEST(RecordCounts, FollowEveryTransaction) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db", {.sync_wal = false});
  SeededRandom random(1);
  uint32_t removals = 0;
  for (int round = 0; round < 60; ++round) {
    const auto transaction = database->BeginTransaction();
    if (random.Below(2) == 0) {
      DatabaseState state = SampleState(7);
      state.counts = DatabaseCounts{.images = 999, .placed = 999};
      if (random.Below(2) == 0) state.counts.reset();
      transaction->PutState(state);
    }
    // Few ids, so that one image is put several times, in one transaction too.
    for (uint32_t put = random.Below(5); put > 0; --put) {
      const uint32_t id = 1 + random.Below(8);
      transaction->PutImage(ImageWith(id, kVerdicts[random.Below(5)]));
    }
    // After puts of the same image, perhaps.
    const ImageId gone(1 + random.Below(8));
    if (random.Below(3) == 0 && database->GetSnapshot()->GetImage(gone).ok()) {
      transaction->RemoveImage(gone);
      ++removals;
    }
    for (uint32_t put = random.Below(3); put > 0; --put)
      transaction->PutCamera({CameraId(1 + random.Below(4)), "c", {}, ""});
    if (random.Below(8) == 0) {
      transaction->PutPose({});  // no valid record: nothing of this transaction is applied
      EXPECT_FALSE(transaction->Commit().ok());
    } else {
      ASSERT_OK(transaction->Commit());
    }
    const auto snapshot = database->GetSnapshot();
    const auto state = snapshot->GetState();
    ASSERT_OK(state);
    ASSERT_TRUE(state->counts.has_value());
    ASSERT_EQ(*state->counts, *CountRecords(*snapshot)) << "round " << round;
    ASSERT_EQ(*snapshot->GetCounts(), *state->counts);
  }
  EXPECT_GT(removals, 5u) << "the test has removed images";
}

TEST(RecordCounts, PutsThatChangeNoCountWriteNoState) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutImage(ImageWith(1, Verdict::kPlaced));
  ASSERT_OK(transaction->Commit());
  // Two transactions that do not touch the state do not conflict.
  const auto first = database->BeginTransaction();
  const auto second = database->BeginTransaction();
  first->PutImage(ImageWith(1, Verdict::kMerged));
  second->PutImage(ImageWith(1, Verdict::kFounded));
  ASSERT_OK(first->Commit());
  EXPECT_OK(second->Commit());
}

TEST(RecordCounts, OldStateIsReadWithoutCounts) {
  DatabaseState state;
  ASSERT_OK(Decode(StateWithoutCounts(), &state));
  EXPECT_FALSE(state.counts.has_value());
  DatabaseState expected = SampleState(3);
  expected.counts.reset();
  EXPECT_EQ(state, expected);
}

TEST(RecordCounts, ReaderOfAnOldStateCountsByItself) {
  const TemporaryFolder folder;
  MakeOldDatabase(folder / "db");
  const auto database = MustOpen(folder / "db", {.read_only = true});
  EXPECT_FALSE(database->GetSnapshot()->GetState()->counts.has_value());
  EXPECT_EQ(*database->GetSnapshot()->GetCounts(), kOldCounts);
}

TEST(RecordCounts, OpeningForWritingCountsOnceAndAgainAfterAnOldProgram) {
  const TemporaryFolder folder;
  MakeOldDatabase(folder / "db");
  for (int time = 0; time < 2; ++time) {
    auto database = MustOpen(folder / "db", {});
    const auto state = database->GetSnapshot()->GetState();
    ASSERT_OK(state);
    EXPECT_EQ(state->counts, kOldCounts);
    EXPECT_EQ(state->next_image, 3u) << "the rest of the state stays";
    const uint64_t sequence = database->GetSnapshot()->sequence();
    database.reset();
    database = MustOpen(folder / "db", {});
    EXPECT_EQ(database->GetSnapshot()->sequence(), sequence) << "counted twice";
    database.reset();
    WriteOldState(folder / "db");
  }
}

TEST(RecordCounts, UpgradeThatIsInterruptedIsMadeUpFor) {
  const TemporaryFolder folder;
  MakeOldDatabase(folder / "db");
  bool reached = true;
  for (uint64_t n = 1; reached; ++n) {
    ASSERT_LT(n, 1000u);
    const std::string path = folder / ("copy" + std::to_string(n));
    std::filesystem::copy(folder / "db", path, std::filesystem::copy_options::recursive);
    const auto fs = std::make_shared<FaultFileSystem>();
    fs->FailWrites(n, Fault::kIoError, FaultFileSystem::kForever);
    {
      const auto opened = Database::Open(path, {.file_system = fs});
      if (opened.ok()) {
        EXPECT_EQ(*(*opened)->GetSnapshot()->GetCounts(), kOldCounts);
      }
    }
    reached = fs->fault_count() > 0;
    fs->DropUnsyncedData();
    const auto database = MustOpen(path, {.file_system = fs});
    ASSERT_NE(database, nullptr) << "write " << n;
    EXPECT_EQ(database->GetSnapshot()->GetState()->counts, kOldCounts) << "write " << n;
  }
}

TEST(RecordCounts, CountsThatCannotBeRightAreDropped) {
  CountChanges changes;
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutImage(ImageWith(1, Verdict::kPostponed));
  ASSERT_OK(transaction->Commit());
  ASSERT_OK(changes.NotePut(*database->GetSnapshot(), ImageWith(1, Verdict::kPlaced)));
  const DatabaseCounts right = {.images = 1, .postponed = 1};
  EXPECT_EQ(changes.ApplyTo(right), (DatabaseCounts{.images = 1, .placed = 1}));
  EXPECT_EQ(changes.ApplyTo(DatabaseCounts{}), std::nullopt) << "there is no postponed image";
  EXPECT_EQ(changes.ApplyTo(std::nullopt), std::nullopt);
}

}  // namespace
}  // namespace veduta
