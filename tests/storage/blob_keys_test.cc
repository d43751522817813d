// SPDX-License-Identifier: Apache-2.0
// Goal: the keys of large values are listed as a snapshot sees them: no deleted one, no later one,
//   each once, in order, however many versions it has and wherever its value lies.
// Method: photos written, dropped and written again, in memory and in files, against a set.
#include "storage/blob_keys.h"

#include <gtest/gtest.h>

#include <set>

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
