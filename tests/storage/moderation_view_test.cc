// SPDX-License-Identifier: Apache-2.0
// Goal: what is hidden, reported and used up is stored until it is taken back, over closing and
//   opening, beside commits of others and without holding them up.
// Method: a small database that is closed and opened between.
#include "storage/moderation_view.h"

#include <gtest/gtest.h>

#include "samples.h"
#include "storage/database.h"

namespace veduta {
namespace {

TEST(ModerationView, KeepsWhatIsStored) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutHidden({HiddenKind::kContribution, 1, 5, "kai", "asked"});
  transaction->PutHidden({HiddenKind::kImage, 300, 6, "kai", ""});
  transaction->PutHidden({HiddenKind::kImage, 2, 7, "ada", ""});
  for (const uint32_t number : {2u, 1u}) {
    ReportRecord report;
    report.number = number;
    report.image = ImageId(9);
    report.text = std::to_string(number);
    transaction->PutReport(report);
  }
  // Meanwhile, without a turn: the commit does not mind.
  const TokenUse uses[] = {{7, 1, 2, 3, 4}, {0, 1, 0, 0, 5}};
  ASSERT_OK(database->PutTokenUse(uses));
  ASSERT_OK(transaction->Commit());
  database.reset();
  database = MustOpen(folder / "db", {});
  const auto snapshot = database->GetSnapshot();
  const ModerationReader& moderation = snapshot->moderation();
  const auto hidden = moderation.ListHidden();
  ASSERT_OK(hidden);
  ASSERT_EQ(hidden->size(), 3u);
  EXPECT_EQ(hidden->at(0).number, 2u) << "images before contributions, by their numbers";
  EXPECT_EQ(hidden->at(1).number, 300u);
  EXPECT_EQ(hidden->at(2).kind, HiddenKind::kContribution);
  EXPECT_EQ(hidden->at(2).reason, "asked");
  EXPECT_TRUE(*moderation.IsHidden(HiddenKind::kImage, 300));
  EXPECT_FALSE(*moderation.IsHidden(HiddenKind::kImage, 1));
  EXPECT_FALSE(*moderation.IsHidden(HiddenKind::kContribution, 2));
  EXPECT_EQ(moderation.ListReports()->at(1).text, "2");
  EXPECT_EQ((*moderation.FindReport(1))->text, "1");
  EXPECT_FALSE(moderation.FindReport(3)->has_value());
  EXPECT_EQ(moderation.ListTokenUse()->at(0).reports, 5);
  EXPECT_EQ(moderation.ListTokenUse()->at(1).bytes, 3);
}

TEST(ModerationView, TakesBackAndReplaces) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  auto transaction = database->BeginTransaction();
  transaction->PutHidden({HiddenKind::kImage, 2, 7, "ada", ""});
  ASSERT_OK(transaction->Commit());
  transaction = database->BeginTransaction();
  transaction->DeleteHidden(HiddenKind::kImage, 2);
  transaction->DeleteHidden(HiddenKind::kImage, 3);
  ASSERT_OK(transaction->Commit());
  EXPECT_TRUE(database->GetSnapshot()->moderation().ListHidden()->empty());
  for (const double photos : {1.0, 2.0}) {
    const TokenUse use{7, 1, photos, 0, 0};
    ASSERT_OK(database->PutTokenUse({&use, 1}));
  }
  ASSERT_EQ(database->GetSnapshot()->moderation().ListTokenUse()->size(), 1u);
  EXPECT_EQ(database->GetSnapshot()->moderation().ListTokenUse()->front().photos, 2);
  const TokenUse wrong{7, 1, -1, 0, 0};
  EXPECT_EQ(database->PutTokenUse({&wrong, 1}).code(), StatusCode::kInvalidArgument);
  transaction = database->BeginTransaction();
  transaction->PutHidden({HiddenKind::kImage, 0, 7, "ada", ""});
  EXPECT_EQ(transaction->Commit().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
