// SPDX-License-Identifier: Apache-2.0
// Goal: entries of the journal about what must not be told keep their number, time and action, and
//   nothing else; all others are told as they are, unless a part of the city alone is seen.
// Method: entries of each kind in a database where one image and one contribution are hidden.
#include "engine/query/journal_sight.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

class JournalSight : public testing::Test {
 protected:
  JournalSight() {
    const auto transaction = database_->BeginTransaction();
    ImageRecord image = SampleImage(1);
    transaction->PutImage(image);
    image = SampleImage(2);
    image.contribution = 3;
    transaction->PutImage(image);
    transaction->PutHidden({HiddenKind::kImage, 1, 7, "kai", ""});
    transaction->PutHidden({HiddenKind::kContribution, 3, 7, "kai", ""});
    EXPECT_OK(transaction->Commit());
  }

  // What is left of an entry.
  std::string Told(const std::string& action, ImageId image, const std::string& detail,
                   const Sight& sight = {.sees_hidden = false}) {
    std::vector<JournalAnswer> entries = {{4, 9, "anna", action, image, {}, detail}};
    const auto snapshot = database_->GetSnapshot();
    EXPECT_OK(MaskEntries({*snapshot, sight}, &entries));
    const JournalAnswer& entry = entries.front();
    EXPECT_EQ(entry.sequence, 4u);
    EXPECT_EQ(entry.time_unix_s, 9);
    EXPECT_EQ(entry.action, action);
    EXPECT_TRUE(!entry.actor.empty() || entry.detail.empty());
    EXPECT_EQ(entry.image.valid(), image.valid() && !entry.actor.empty());
    return entry.actor;
  }
  // The detail that is left of an entry.
  std::string Detail(const std::string& action, ImageId image, const std::string& detail,
                     const Sight& sight = {.sees_hidden = false}) {
    std::vector<JournalAnswer> entries = {{4, 9, "anna", action, image, {}, detail}};
    EXPECT_OK(MaskEntries({*database_->GetSnapshot(), sight}, &entries));
    return entries.front().detail;
  }

  const TemporaryFolder folder_;
  std::unique_ptr<Database> database_ = MustCreate(folder_ / "db");
};

TEST_F(JournalSight, TellsNothingOfWhatIsHidden) {
  EXPECT_EQ(Told("add", ImageId(1), "placed"), "") << "hidden";
  EXPECT_EQ(Told("add", ImageId(2), "placed"), "") << "hidden with its contribution";
  EXPECT_EQ(Told("add", ImageId(5), "placed"), "anna") << "removed, and never hidden";
  EXPECT_EQ(Told("contribution", {}, "opened 3"), "");
  EXPECT_EQ(Told("contribution", {}, "opened 4"), "anna");
  EXPECT_EQ(Told("contribution", {}, "of a kind that is not known"), "anna");
  EXPECT_EQ(Told("adjust", {}, "5 images"), "anna");
  EXPECT_EQ(Told("add", ImageId(1), "placed", {}), "anna") << "to curators";
}

TEST_F(JournalSight, NoDetailNamesWhatIsHidden) {
  const std::string hidden = "images 1 and 6: they are twins", seen = "images 5 and 6";
  for (const char* action : {"forbid", "allow"}) {
    EXPECT_EQ(Detail(action, {}, hidden), "") << action;
    EXPECT_EQ(Detail(action, {}, "images 6 and 1"), "") << action;
    EXPECT_EQ(Detail(action, {}, seen), seen) << action;
    EXPECT_EQ(Detail(action, {}, hidden, {}), hidden) << "to curators";
    EXPECT_EQ(Told(action, {}, hidden), "anna") << "that there is one is told";
  }
  EXPECT_EQ(Detail("add", ImageId(5), "founded with image 2"), "") << "hidden in a contribution";
  EXPECT_EQ(Detail("add", ImageId(5), "founded with image 6"), "founded with image 6");
  EXPECT_EQ(Detail("adjust", {}, "1 images, image, images and 1"), "1 images, image, images and 1");
}

TEST_F(JournalSight, WhoComplainsAndHidesIsForCurators) {
  for (const char* action : {"hide", "unhide", "report", "dismiss"}) {
    EXPECT_EQ(Told(action, ImageId(5), "why"), "") << action;
    EXPECT_EQ(Told(action, ImageId(5), "why", {}), "anna") << action;
  }
}

TEST_F(JournalSight, APartIsToldOfItselfAlone) {
  const Sight part{.contribution = 3};
  EXPECT_EQ(Told("add", ImageId(2), "placed", part), "anna");
  EXPECT_EQ(Told("add", ImageId(1), "placed", part), "");
  EXPECT_EQ(Told("contribution", {}, "opened 3", part), "anna");
  EXPECT_EQ(Told("contribution", {}, "opened 4", part), "");
  EXPECT_EQ(Told("adjust", {}, "5 images", part), "");
}

// A merge that is refused is about another reconstruction as well, and details name what is beside.
TEST_F(JournalSight, APartIsToldOfNothingBesideIt) {
  const Sight part{.contribution = 3};
  EXPECT_EQ(Told("hypothesis", ImageId(2), "refused: reconstruction 7 looks alike", part), "");
  EXPECT_EQ(Told("hypothesis", ImageId(2), "refused", {.sees_hidden = true}), "anna");
  EXPECT_EQ(Detail("add", ImageId(2), "placed in reconstruction 7", part), "");
  EXPECT_EQ(Detail("contribution", {}, "opened 3", part), "opened 3") << "it names itself alone";
  std::vector<JournalAnswer> entries = {{4, 9, "anna", "add", ImageId(2), ReconstructionId(7), ""}};
  EXPECT_OK(MaskEntries({*database_->GetSnapshot(), part}, &entries));
  EXPECT_FALSE(entries.front().reconstruction.valid()) << "no photo of the part stands there now";
  EXPECT_TRUE(entries.front().image.valid());
}

}  // namespace
}  // namespace veduta
