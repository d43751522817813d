// SPDX-License-Identifier: Apache-2.0
// Goal: a placement is stored with the verdicts of the founding triple, the journal of its merges
//   and the photos to be tried again; a postponed photo writes nothing.
// Method: a synthetic scene in a database; what was written is read back.
#include "engine/ingest/placement_writer.h"

#include <gtest/gtest.h>

#include "engine/ingest/photo_placement.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

TEST(PlacementWriter, WritesAFounding) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  SceneWork work(&scene);
  const auto placed = PlacePhoto(work.context, *scene.Photo(5), scene.MatchesOf(5, {0, 1, 2, 3, 4}),
                                 ReconstructionId(1), 1);
  ASSERT_OK(placed);
  ASSERT_EQ(placed->verdict, Verdict::kFounded) << placed->detail;
  DatabaseState state = scene.State();
  const auto transaction = scene.database()->BeginTransaction();
  ASSERT_OK(WritePlacement(work.map, *scene.Snap(), *placed, {}, &state, transaction.get()));
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
  EXPECT_EQ(scene.State().next_reconstruction, 2u);
  EXPECT_EQ(scene.State().pending_propagation.size(), 3u) << "the three that have no pose";
  for (const ImageId id : scene.State().pending_propagation) EXPECT_FALSE(work.map.HasImage(id));
  for (size_t i = 1; i < 3; ++i) {
    const ImageRecord member = *scene.Snap()->GetImage(placed->placed[i]);
    EXPECT_EQ(member.verdict, Verdict::kFounded);
    EXPECT_EQ(member.detail, "founded with image 6");
  }
}

TEST(PlacementWriter, JournalsMergesAndWritesNothingForAPostponedPhoto) {
  SceneDatabase scene({.camera_count = 8});
  scene.AddImages(0, 8);
  scene.AddReconstruction({0, 1, 2, 3});
  scene.AddReconstruction({5, 6}, AnotherFrame());
  SceneWork work(&scene);
  const auto placed =
      PlacePhoto(work.context, *scene.Photo(4), scene.MatchesOf(4, {0, 1, 2, 3, 5, 6}), {}, 1);
  ASSERT_OK(placed);
  ASSERT_EQ(placed->merges.size(), 1u);
  DatabaseState state = scene.State();
  const uint64_t first_entry = state.next_journal;
  const auto transaction = scene.database()->BeginTransaction();
  ASSERT_OK(WritePlacement(work.map, *scene.Snap(), Placement(), {}, &state, transaction.get()));
  EXPECT_EQ(state, scene.State());
  ASSERT_OK(WritePlacement(work.map, *scene.Snap(), *placed, {}, &state, transaction.get()));
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
  std::vector<JournalRecord> entries;
  ASSERT_OK(scene.Snap()->ScanJournal(first_entry, [&](const JournalRecord& entry) {
    entries.push_back(entry);
    return true;
  }));
  ASSERT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries[0].action, "merge");
  EXPECT_EQ(entries[0].reconstruction, ReconstructionId(1));
  EXPECT_EQ(entries[0].detail.rfind("reconstruction 2 by ", 0), 0u) << entries[0].detail;
  EXPECT_EQ(scene.State().pending_propagation, std::vector{ImageId(8)});
}

}  // namespace
}  // namespace veduta
