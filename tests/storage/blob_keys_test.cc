// SPDX-License-Identifier: Apache-2.0
// Goal: the keys of large values are listed as a snapshot sees them: no deleted one, no later one,
//   each once, in order, however many versions it has and wherever its value lies.
// Method: photos written, dropped and written again, in memory and in files, against a set.
#include "storage/blob_keys.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "log_damage.h"
#include "samples.h"

namespace veduta {
namespace {

std::set<ContentHash> KeysOf(const Snapshot& snapshot) {
  std::set<ContentHash> keys;
  EXPECT_OK(snapshot.ScanPhotoKeys([&](const ContentHash& photo) {
    EXPECT_TRUE(keys.empty() || *keys.rbegin() < photo) << "ascending, each once";
    keys.insert(photo);
    return true;
  }));
  return keys;
}

TEST(BlobKeys, EverySnapshotSeesItsOwn) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  SeededRandom random(3);
  std::set<ContentHash> expected;
  std::vector<std::pair<std::shared_ptr<const Snapshot>, std::set<ContentHash>>> held;
  for (int step = 0; step < 300; ++step) {
    // Few photos, so that one has more versions than a page holds; more pages than one.
    const uint32_t seed = 1 + random.Below(step < 150 ? 3 : 80);
    const ContentHash photo = SampleHash(seed);
    if (expected.insert(photo).second) {
      ASSERT_OK(database->WritePhotoAhead(photo, SampleBytes(seed, 100), SampleFeatures(1, 1)));
    } else {
      ASSERT_OK(database->DropPhotoAhead(photo));
      expected.erase(photo);
    }
    if (step % 25 == 0) held.emplace_back(database->GetSnapshot(), expected);
    if (step % 90 == 89) {
      ASSERT_OK(database->Compact());
    }
  }
  held.emplace_back(database->GetSnapshot(), expected);
  for (const auto& [snapshot, keys] : held) EXPECT_EQ(KeysOf(*snapshot), keys);
  EXPECT_GT(expected.size(), 32u) << "more than one page";
}

std::string Content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// The only block of the table, with the keys, begins the file. The family meta, which opening
// reads, has the key "state".
TEST(BlobKeys, DamagedTableIsNoEnd) {
  const TemporaryFolder folder;
  {
    const auto database = MustCreate(folder / "db");
    ASSERT_OK(database->WritePhotoAhead(SampleHash(1), SampleBytes(1, 100), SampleFeatures(1, 1)));
    const auto transaction = database->BeginTransaction();
    transaction->PutImage(SampleImage(1));
    ASSERT_OK(transaction->Commit());
    ASSERT_OK(database->Compact());
  }
  for (const auto& file : std::filesystem::directory_iterator(folder / "db")) {
    const bool is_table = file.path().extension() == ".sst";
    if (is_table && Content(file.path()).find("state") == std::string::npos)
      FlipBit(file.path(), 3);
  }
  const auto database = MustOpen(folder / "db", {.read_only = true});
  ASSERT_NE(database, nullptr);
  const auto snapshot = database->GetSnapshot();
  const auto visit = [](const ContentHash&) { return true; };
  EXPECT_EQ(snapshot->ScanPhotoKeys(visit).code(), StatusCode::kCorruption);
  EXPECT_EQ(snapshot->ScanFeatureKeys(visit).code(), StatusCode::kCorruption);
}

TEST(BlobKeys, StopsWhenToldTo) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    ASSERT_OK(database->WritePhotoAhead(SampleHash(seed), SampleBytes(seed, 100),
                                        SampleFeatures(seed, 1)));
  }
  size_t count = 0;
  ASSERT_OK(
      database->GetSnapshot()->ScanFeatureKeys([&](const ContentHash&) { return ++count < 2; }));
  EXPECT_EQ(count, 2u);
}

}  // namespace
}  // namespace veduta
