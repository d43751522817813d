// SPDX-License-Identifier: Apache-2.0
// Goal: a repair keeps contributions (HealContributions) with what became of their photos, and
//   photos that arrive in parts (HealUploads); it leaves out what cannot be read.
// Method: both in a street database, whose values are overwritten; the whole repair is run.
#include "engine/repair/healing.h"
#include "storage/records/contribution_record.h"
#include "storage/records/partial_upload_record.h"
#include "tests/engine/repair/repaired_city.h"

namespace veduta {
namespace {

class ContributionHealing : public testing::Test {
 protected:
  ContributionHealing() {
    EXPECT_OK(city_.engine().OpenContribution({"anna", "a walk", "CC0", "anna"}));
    EXPECT_OK(city_.engine().OpenContribution({"bela", "", "", "bela"}));
    for (const Stand& stand : Walk(6, 0.9, 4)) {
      PhotoSubmission photo = city_.Submit(stand);
      photo.contribution = 1;
      EXPECT_OK(city_.engine().Submit(std::move(photo))->Wait());
    }
    EXPECT_OK(city_.engine().Settle());
    UploadRecord upload;
    upload.name = "5.jpg";
    upload.contributor = "anna";
    upload.contribution = 1;
    const std::vector<uint8_t> bytes = SampleBytes(1, 500);
    upload.photo = HashContent(bytes);
    upload.size_bytes = bytes.size();
    EXPECT_OK(city_.parts().database->AddUpload(upload, bytes));
    for (std::string& id : ids_) {
      const auto begun = city_.engine().BeginUpload({"6.jpg", "anna", "", 1, 0, 1'000}, {});
      EXPECT_OK(begun);
      id = begun->id;
      EXPECT_OK(city_.engine().ContinueUpload(id, 0, SampleBytes(2, 700)));
    }
    city_.Close();
  }

  City city_;
  std::string ids_[2];
};

TEST_F(ContributionHealing, WhatIsWholeIsKept) {
  PartialUploadId second{};
  for (size_t i = 0; i < second.size(); ++i)
    second[i] = static_cast<uint8_t>(std::stoul(ids_[1].substr(2 * i, 2), nullptr, 16));
  Overwrite(city_, Family::kUploads, PieceKey(second, 0), "damaged");
  EXPECT_EQ(Repair(&city_).findings.size(), 1u);
  const auto contribution = city_.Ask().door().Contribution(1);
  ASSERT_OK(contribution);
  EXPECT_EQ(contribution->comment, "a walk");
  EXPECT_EQ(contribution->photos, 5u);
  const auto sums = city_.Ask().door().ContributionVerdicts(1);
  ASSERT_OK(sums);
  EXPECT_EQ(sums->placed, 4u);
  EXPECT_EQ(sums->waiting, 1u);
  EXPECT_EQ(sums->arriving, 1u);
  EXPECT_EQ(city_.Ask().door().PartialUpload(ids_[0])->received_bytes, 700u);
  EXPECT_EQ(city_.Ask().door().PartialUpload(ids_[1]).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(city_.Ask().door().Contribution(2)->contributor, "bela");
}

TEST_F(ContributionHealing, WhatCannotBeReadIsLeftOut) {
  Overwrite(city_, Family::kContributions, ContributionKey(2), "damaged");
  EXPECT_EQ(Repair(&city_).findings.size(), 1u);
  EXPECT_EQ(city_.Ask().door().ContributionVerdicts(1)->placed, 4u);
  EXPECT_EQ(city_.Ask().door().Contribution(2).status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
