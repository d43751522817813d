// SPDX-License-Identifier: Apache-2.0
// Goal: the model of the bad days is right, and it can say no: on good days it equals the database,
//   and a record more, less or changed is a difference.
// Method: random transactions without any fault; then records that are changed.
#include "modeled_city.h"

#include <gtest/gtest.h>

#include "stored_families.h"

namespace veduta {
namespace {

constexpr int kTransactions = 60;

TEST(ModeledCity, EqualsTheDatabaseOnGoodDays) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db", {.sync_wal = false});
  ModeledCity city = ModeledCity::New();
  SeededRandom random(5);
  std::set<Family> used;
  for (int i = 0; i < kTransactions; ++i) {
    ModeledTransaction transaction(database.get(), city, &random);
    ASSERT_OK(transaction.Run());
    ASSERT_OK(transaction.Commit());
    city = transaction.after();
    Records stored;
    ASSERT_OK(ReadAll(*database->GetSnapshot(), &stored));
    ASSERT_EQ(DifferenceOf(city.records, stored), "") << "after transaction " << i;
  }
  for (const auto& [key, value] : city.records) used.insert(key.first);
  EXPECT_EQ(used.size(), kFamilyCount - 3)
      << "every family but the queue, the uploads and the contributions has records";
  database.reset();
  database = MustOpen(folder / "db", {});
  Records stored;
  ASSERT_OK(ReadAll(*database->GetSnapshot(), &stored));
  EXPECT_EQ(DifferenceOf(city.records, stored), "");
}

TEST(ModeledCity, NoticesEveryRecordThatIsMissingOrDiffers) {
  const TemporaryFolder folder;
  ModeledCity city = ModeledCity::New();
  SeededRandom random(6);
  {
    const auto database = MustCreate(folder / "db", {.sync_wal = false});
    for (int i = 0; i < kTransactions; ++i) {
      ModeledTransaction transaction(database.get(), city, &random);
      ASSERT_OK(transaction.Run());
      ASSERT_OK(transaction.Commit());
      city = transaction.after();
    }
  }
  StoredFamilies stored(folder / "db");
  const auto equals = [&] {
    Records records;
    EXPECT_OK(ReadAll(*stored.GetSnapshot(), &records));
    return DifferenceOf(city.records, records).empty();
  };
  ASSERT_TRUE(equals());
  std::set<Family> done;
  for (const auto& [key, value] : city.records) {
    if (!done.insert(key.first).second) continue;
    stored.Delete(key.first, key.second);
    EXPECT_FALSE(equals()) << FamilyName(key.first);
    stored.Put(key.first, key.second, value + "x");
    EXPECT_FALSE(equals()) << FamilyName(key.first);
    stored.PutBack();
    stored.Put(key.first, key.second + "x", value);
    EXPECT_FALSE(equals()) << FamilyName(key.first);
    stored.PutBack();
  }
  EXPECT_TRUE(equals());
}

}  // namespace
}  // namespace veduta
