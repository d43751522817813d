// SPDX-License-Identifier: Apache-2.0
// Goal: reconstructions that were merged into others are not listed, the largest living one is
//   found, and who asks for one that is not there is told what to do or where it went.
// Method: a database of a few reconstructions, two of them of one size and two merged away.
#include "engine/query/living.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

class LivingTest : public testing::Test {
 protected:
  void Put(uint32_t id, uint32_t image_count, uint32_t merged_into = 0) {
    ReconstructionRecord record = SampleReconstruction(id, 1);
    record.image_count = image_count;
    record.merged_into = ReconstructionId(merged_into);
    const auto transaction = database_->BeginTransaction();
    transaction->PutReconstruction(record);
    ASSERT_OK(transaction->Commit());
  }
  void PutFive() {
    Put(1, 7);
    Put(2, 90, 4);  // the largest of all, merged away
    Put(3, 12);
    Put(4, 12);
    Put(5, 0, 3);
  }

  const TemporaryFolder folder_;
  const std::unique_ptr<Database> database_ = MustCreate(folder_ / "db");
};

TEST_F(LivingTest, ListsTheLargestFirstThenTheOldestAndNoneThatWasMergedAway) {
  EXPECT_TRUE(ListLiving(*database_->GetSnapshot())->empty());
  PutFive();
  const auto living = ListLiving(*database_->GetSnapshot());
  ASSERT_OK(living);
  std::vector<uint32_t> ids;
  for (const ReconstructionRecord& record : *living) {
    EXPECT_TRUE(record.is_living());
    ids.push_back(record.id.value);
  }
  EXPECT_EQ(ids, (std::vector<uint32_t>{3, 4, 1}));
}

TEST_F(LivingTest, TheLargestIsOneThatLives) {
  PutFive();
  const auto largest = LargestLiving(*database_->GetSnapshot());
  ASSERT_OK(largest);
  EXPECT_EQ(largest->id, ReconstructionId(3));
  EXPECT_EQ(largest->image_count, 12u);
}

TEST_F(LivingTest, WithoutALivingOneThereIsNoLargest) {
  for (const bool merged : {false, true}) {
    if (merged) Put(2, 90, 4);
    const Status status = LargestLiving(*database_->GetSnapshot()).status();
    EXPECT_EQ(status.code(), StatusCode::kNotFound) << merged;
    EXPECT_EQ(status.message(), "there is no reconstruction yet: add photos first") << merged;
  }
}

TEST_F(LivingTest, OneThatWasMergedAwayIsNotFoundWhereItWent) {
  PutFive();
  const auto snapshot = database_->GetSnapshot();
  const auto living = GetLiving(*snapshot, ReconstructionId(4));
  ASSERT_OK(living);
  EXPECT_EQ(living->id, ReconstructionId(4));
  const Status merged = GetLiving(*snapshot, ReconstructionId(2)).status();
  EXPECT_EQ(merged.code(), StatusCode::kNotFound);
  EXPECT_EQ(merged.message(), "reconstruction 2 was merged into reconstruction 4");
  const Status unknown = GetLiving(*snapshot, ReconstructionId(6)).status();
  EXPECT_EQ(unknown.code(), StatusCode::kNotFound);
  EXPECT_NE(unknown.message().find("6"), std::string::npos) << unknown.message();
}

TEST_F(LivingTest, OneThatWasDissolvedIsRememberedOnly) {
  ReconstructionRecord record;
  record.id = ReconstructionId(1);
  record.is_dissolved = true;
  const auto transaction = database_->BeginTransaction();
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  const auto snapshot = database_->GetSnapshot();
  EXPECT_TRUE(ListLiving(*snapshot)->empty());
  EXPECT_EQ(LargestLiving(*snapshot).status().code(), StatusCode::kNotFound);
  const Status dissolved = GetLiving(*snapshot, ReconstructionId(1)).status();
  EXPECT_EQ(dissolved.code(), StatusCode::kNotFound);
  EXPECT_EQ(dissolved.message(),
            "reconstruction 1 was dissolved: all its images have lost their poses");
}

}  // namespace
}  // namespace veduta
