// SPDX-License-Identifier: Apache-2.0
// Goal: what the journal tells of images, cameras, reconstructions and the vocabulary is what its
//   last entries say, and a repair's entry restates it.
// Method: entries by hand, one after the other.
#include "engine/query/told_by_journal.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

JournalRecord Entry(const std::string& actor, const std::string& action, uint32_t image,
                    uint32_t reconstruction, const std::string& detail) {
  return {1, 0, actor, action, ImageId(image), ReconstructionId(reconstruction), detail};
}

TEST(ToldByJournal, TheLastEntryCounts) {
  ToldByJournal told;
  ImageRecord image;
  image.id = ImageId(1);
  image.contributor = "anna";
  image.verdict = Verdict::kPlaced;
  image.reason = Reason::kRegistered;
  image.detail = "agrees";
  EXPECT_FALSE(told.AgreesWith(image));
  told.Take(Entry("anna", "add", 1, 1, "agrees"));
  EXPECT_TRUE(told.AgreesWith(image));
  told.Take(Entry("veduta", "propagate", 1, 1, "later"));
  EXPECT_FALSE(told.AgreesWith(image));
  told.Take(Entry("anna", "repair", 1, 0, "rejected: gone"));
  EXPECT_FALSE(told.AgreesWith(image));
  image.verdict = Verdict::kRejected;
  image.reason = Reason::kUnreadable;
  image.detail = "gone";
  EXPECT_TRUE(told.AgreesWith(image));
  image.contributor = "otto";
  EXPECT_FALSE(told.HasContributorOf(image));
}

TEST(ToldByJournal, ARemovedImageIsToldOfNoMore) {
  ToldByJournal told;
  ImageRecord image;
  image.id = ImageId(1);
  image.contributor = "anna";
  told.Take(Entry("anna", "add", 1, 0, "seen"));
  told.Take(Entry("anna", "add", 2, 0, "seen"));
  EXPECT_TRUE(told.HasContributorOf(image));
  told.Take(Entry("bea", "remove", 1, 0, "my door"));
  EXPECT_FALSE(told.HasContributorOf(image));
  EXPECT_EQ(told.removed, std::set<ImageId>{ImageId(1)});
  image.id = ImageId(2);
  EXPECT_TRUE(told.HasContributorOf(image));
}

TEST(ToldByJournal, NamesCamerasAdjustmentsAndTheVocabulary) {
  ToldByJournal told;
  DatabaseState state;
  EXPECT_TRUE(told.AgreesWith(state));
  EXPECT_EQ(told.ImagesAtAdjustment(ReconstructionId(1)), 3u);
  told.Take(Entry("veduta", "camera", 0, 0, "canon (camera 1): 512x384 450,450,255,191"));
  told.Take(Entry("veduta", "camera", 0, 0, "an older one"));
  EXPECT_EQ(told.cameras, (std::set<std::string>{"an older one", "canon"}));
  told.Take(Entry("veduta", "adjust", 0, 1, "20 images"));
  EXPECT_EQ(told.ImagesAtAdjustment(ReconstructionId(1)), 20u);
  told.Take(Entry("veduta", "repair", 0, 1, "12 images"));
  EXPECT_EQ(told.ImagesAtAdjustment(ReconstructionId(1)), 12u);
  told.Take(Entry("veduta", "merge", 0, 1, ""));
  EXPECT_EQ(told.ImagesAtAdjustment(ReconstructionId(1)), 12u) << "not adjusted since";
  told.Take(Entry("veduta", "vocabulary", 0, 0, "imported 100 words for 60 images"));
  state.vocabulary_generation = 1;
  state.images_at_vocabulary = 60;
  state.vocabulary_imported = true;
  EXPECT_TRUE(told.AgreesWith(state));
  told.Take(Entry("veduta", "vocabulary", 0, 0, "dropped by repair"));
  EXPECT_FALSE(told.AgreesWith(state));
  EXPECT_TRUE(told.AgreesWith(DatabaseState()));
}

TEST(ToldByJournal, AnImageThatLostItsPoseHasItsReasonThere) {
  ToldByJournal told;
  told.Take(Entry("anna", "add", 1, 1, "agrees"));
  told.Take(Entry("veduta", "doubt", 1, 1, "in reconstruction 1, it contradicts"));
  ImageRecord image;
  image.id = ImageId(1);
  image.contributor = "anna";
  image.verdict = Verdict::kPostponed;
  image.reason = Reason::kDoubted;
  image.detail = "in reconstruction 1, it contradicts";
  EXPECT_TRUE(told.AgreesWith(image));
  image.detail = "another";
  EXPECT_FALSE(told.AgreesWith(image));
  // A new attempt that fails has no entry.
  image.reason = Reason::kResectionFailed;
  EXPECT_TRUE(told.AgreesWith(image));
}

TEST(ToldByJournal, APartThatIsSplitOffWasAdjustedThen) {
  ToldByJournal told;
  told.Take(Entry("veduta", "split", 0, 2, "5 images of reconstruction 1, whose frame it keeps"));
  EXPECT_EQ(told.ImagesAtAdjustment(ReconstructionId(2)), 5u);
  told.Take(Entry("veduta", "adjust", 0, 2, "9 images"));
  EXPECT_EQ(told.ImagesAtAdjustment(ReconstructionId(2)), 9u);
}

}  // namespace
}  // namespace veduta
