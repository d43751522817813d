// SPDX-License-Identifier: Apache-2.0
// Goal: what followed by itself since people last did something is counted from the journal: which
//   images were doubted, how many parts were split off, and how many of them came back.
// Method: entries of the journal and records of reconstructions, without a city around them.
#include "engine/ingest/local_unplacing.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

class WhatFollowed : public testing::Test {
 protected:
  void Note(const std::string& action, ImageId image, ReconstructionId reconstruction) {
    DatabaseState state = scene_.State();
    const auto transaction = scene_.database()->BeginTransaction();
    SceneDatabase::Note({0, 0, "veduta", action, image, reconstruction, ""}, &state,
                        transaction.get());
    ASSERT_OK(transaction->Commit());
  }
  void Split(ReconstructionId part) { Note("split", {}, part); }
  void Add() { Note("add", ImageId(1), {}); }

  void Put(ReconstructionId id, ReconstructionId merged_into) {
    ReconstructionRecord record;
    record.id = id;
    record.merged_into = merged_into;
    const auto transaction = scene_.database()->BeginTransaction();
    transaction->PutReconstruction(record);
    ASSERT_OK(transaction->Commit());
  }

  uint64_t Next() { return scene_.State().next_journal; }
  size_t Undone(uint32_t photos, ReconstructionId into) {
    const auto count =
        CountMergedInto(*scene_.Snap(), *ListSplitOff(*scene_.Snap(), Next(), photos), into);
    EXPECT_OK(count);
    return count.ok() ? *count : 99;
  }

  SceneDatabase scene_;
};

TEST_F(WhatFollowed, DoubtsAndSplitsAreCountedUpToWhatPeopleDid) {
  Note("doubt", ImageId(4), {});
  Split(ReconstructionId(2));
  Add();
  Note("doubt", ImageId(5), {});
  Note("camera", {}, {});  // of a stranger's photo, or a refined one
  Split(ReconstructionId(3));
  Split(ReconstructionId(4));
  const auto snapshot = scene_.Snap();
  EXPECT_EQ(*AlreadyDoubted(*snapshot, Next()), std::set<ImageId>{ImageId(5)});
  EXPECT_EQ(*AlreadyDoubted(*snapshot, Next(), 1), (std::set{ImageId(4), ImageId(5)}));
  EXPECT_EQ(ListSplitOff(*snapshot, Next())->size(), 2u);
}

TEST_F(WhatFollowed, ASplitIsUndoneOnceItsPartCameBack) {
  const ReconstructionId whole(1), back(2), by_a_third(3), apart(4);
  Put(whole, {});
  Put(back, whole);
  Put(by_a_third, back);
  Put(apart, {});
  Split(back);
  Add();
  for (const ReconstructionId part : {by_a_third, apart, whole}) Split(part);
  EXPECT_EQ(Undone(0, whole), 1u);
  EXPECT_EQ(Undone(1, whole), 2u);
  EXPECT_EQ(Undone(1, back), 1u);
  EXPECT_EQ(Undone(1, apart), 0u);
  Add();
  EXPECT_EQ(Undone(0, whole), 0u);
}

TEST_F(WhatFollowed, WhatDoesNotTouchTheMapIsPassedOver) {
  Note("doubt", ImageId(4), {});
  Split(ReconstructionId(2));
  for (const char* action : {"token", "contribution", "georeference", "ground", "backup", "hide"})
    Note(action, {}, {});
  Add();
  EXPECT_EQ(*AlreadyDoubted(*scene_.Snap(), Next(), 1), std::set{ImageId(4)});
  EXPECT_EQ(ListSplitOff(*scene_.Snap(), Next(), 1)->size(), 1u);
  for (const char* action : {"remove", "forbid", "replace"}) {
    Note(action, {}, {});
    EXPECT_TRUE(AlreadyDoubted(*scene_.Snap(), Next(), 1)->empty()) << action;
  }
}

TEST_F(WhatFollowed, EntriesThatAreNotCommittedYetArePassedOver) {
  Note("doubt", ImageId(4), {});
  EXPECT_EQ(*AlreadyDoubted(*scene_.Snap(), Next() + 2), std::set{ImageId(4)});
}

TEST_F(WhatFollowed, ALongJournalIsReadToItsBeginning) {
  Note("doubt", ImageId(4), {});
  for (int i = 0; i < 150; ++i) Note("adjust", {}, ReconstructionId(1));
  Note("doubt", ImageId(5), {});
  EXPECT_EQ(*AlreadyDoubted(*scene_.Snap(), Next()), (std::set{ImageId(4), ImageId(5)}));
}

}  // namespace
}  // namespace veduta
