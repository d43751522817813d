// SPDX-License-Identifier: Apache-2.0
// Goal: a repair (HealModeration) keeps what is hidden and reported; it leaves out what cannot be
//   read, and says so.
// Method: a street database whose values are overwritten; the whole repair is run.
#include "engine/repair/healing.h"
#include "storage/records/forbidden_record.h"
#include "storage/records/report_record.h"
#include "tests/engine/repair/repaired_city.h"

namespace veduta {
namespace {

class ModerationHealing : public testing::Test {
 protected:
  ModerationHealing() {
    city_.Add(Walk(6, 0.9, 4));
    EXPECT_OK(city_.engine().Hide({{"#2"}, 0, "kai", "asked"}));
    EXPECT_OK(city_.engine().Report({"#1", ReportReason::kWrong, "no", "vera"}));
    EXPECT_OK(city_.engine().Report({"#3", ReportReason::kOther, "", "vera"}));
    const TokenUse use{7, 1, 2, 3, 4};
    EXPECT_OK(city_.engine().NoteTokenUse({&use, 1}));
    city_.Close();
  }

  City city_;
};

TEST_F(ModerationHealing, KeepsWhatIsWhole) {
  Overwrite(city_, Family::kMeta, ForbiddenKey(ForbiddenKind::kPair, 1, 2), "damaged");
  EXPECT_EQ(Repair(&city_).findings.size(), 1u);
  const auto hidden = city_.Ask().door().Hidden();
  ASSERT_OK(hidden);
  ASSERT_EQ(hidden->size(), 1u);
  EXPECT_EQ(hidden->front().number, 2u);
  EXPECT_EQ(hidden->front().reason, "asked");
  EXPECT_EQ(city_.Ask().door().Reports(true)->size(), 2u);
  EXPECT_TRUE(city_.Ask().door().TokenUses()->empty()) << "it is forgotten";
}

TEST_F(ModerationHealing, LeavesOutWhatCannotBeRead) {
  Overwrite(city_, Family::kMeta, ReportKey(1), "damaged");
  const RepairAnswer repaired = Repair(&city_);
  ASSERT_EQ(repaired.findings.size(), 1u);
  EXPECT_NE(repaired.findings[0].damage.find("the reports"), std::string::npos);
  EXPECT_TRUE(city_.Ask().door().Reports(false)->empty());
  EXPECT_EQ(city_.Ask().door().Hidden()->size(), 1u);
}

}  // namespace
}  // namespace veduta
