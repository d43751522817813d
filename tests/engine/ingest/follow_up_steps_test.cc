// SPDX-License-Identifier: Apache-2.0
// Goal: RunNextStep carries out waiting photos and adjustments one by one until nothing is due but
//   a vocabulary, which it leaves to others; a
//   step that fails leaves nothing visible, says so once, and is passed over until the object is
//   made anew.
// Method: a synthetic scene in a database; a step fails where another transaction commits under it,
//   and where a record that it reads is missing.
#include "engine/ingest/follow_up_steps.h"

#include <gtest/gtest.h>

#include "engine/ingest/ingest.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

IngestOptions Options() {
  IngestOptions options;
  options.schedule.views_step = 2;
  return options;
}

// Three placed images, of which the whole is due, and one that waits; image 5 waits and does not
// exist where `with_missing`.
void Prepare(SceneDatabase* scene, bool with_missing) {
  scene->AddImages(0, 4);
  const ReconstructionId id = scene->AddReconstruction({0, 1, 2});
  const auto transaction = scene->database()->BeginTransaction();
  DatabaseState state = scene->State();
  if (with_missing) state.pending_propagation.push_back(ImageId(5));
  state.pending_propagation.push_back(ImageId(4));
  transaction->PutState(state);
  ReconstructionRecord record = *scene->Snap()->GetReconstruction(id);
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
}

TEST(FollowUpSteps, RunOneByOneUntilNothingIsDue) {
  SceneDatabase scene;
  Prepare(&scene, false);
  Retrieval retrieval({});
  Ingest ingest(scene.database(), &retrieval, scene.features(), scene.pool(), Options());
  const auto retried = ingest.RunNextStep();
  ASSERT_TRUE(retried.has_value());
  EXPECT_OK(retried->status);
  EXPECT_EQ(retried->kind, FollowUpKind::kPropagation);
  EXPECT_EQ(retried->image, ImageId(4));
  EXPECT_EQ(retried->placed, std::vector{ImageId(4)});
  EXPECT_EQ(scene.Snap()->GetImage(ImageId(4))->reason, Reason::kPropagated);
  const auto adjusted = ingest.RunNextStep();
  ASSERT_TRUE(adjusted.has_value());
  EXPECT_OK(adjusted->status);
  EXPECT_EQ(adjusted->kind, FollowUpKind::kAdjustment);
  EXPECT_EQ(adjusted->reconstruction, ReconstructionId(1));
  LongSteps long_steps;
  EXPECT_FALSE(ingest.RunNextStep(&long_steps).has_value());
  EXPECT_FALSE(long_steps.next.has_value());
  EXPECT_TRUE(FindViolations(*scene.Snap(), 9)->empty());
}

TEST(FollowUpSteps, AFailedStepIsPassedOverUntilTheNextProcess) {
  SceneDatabase scene;
  Prepare(&scene, true);
  Retrieval retrieval({});
  for (int process = 0; process < 2; ++process) {
    Ingest ingest(scene.database(), &retrieval, scene.features(), scene.pool(), Options());
    const auto failed = ingest.RunNextStep();
    ASSERT_TRUE(failed.has_value());
    EXPECT_EQ(failed->image, ImageId(5));
    EXPECT_EQ(failed->status.code(), StatusCode::kNotFound) << failed->status.message();
    EXPECT_TRUE(failed->placed.empty());
    size_t done = 0;
    while (const auto step = ingest.RunNextStep()) {
      EXPECT_OK(step->status);
      ++done;
    }
    EXPECT_EQ(done, process == 0 ? 2u : 0u) << "the others are not held up";
    EXPECT_EQ(scene.State().pending_propagation, std::vector{ImageId(5)});
  }
}

TEST(FollowUpSteps, ATrainingIsLeftToOthers) {
  SceneDatabase scene;
  Prepare(&scene, false);
  Retrieval retrieval({.compare_all_max = 3});
  Ingest ingest(scene.database(), &retrieval, scene.features(), scene.pool(), Options());
  while (ingest.RunNextStep()) EXPECT_FALSE(testing::Test::HasFailure());
  LongSteps long_steps;
  EXPECT_FALSE(ingest.RunNextStep(&long_steps).has_value());
  ASSERT_TRUE(long_steps.next.has_value());
  EXPECT_EQ(long_steps.next->kind, FollowUpKind::kVocabulary);
  EXPECT_EQ(scene.State().vocabulary_generation, 0u);
  ingest.SetAside(*long_steps.next);
  long_steps.next.reset();
  EXPECT_FALSE(ingest.RunNextStep(&long_steps).has_value());
  EXPECT_FALSE(long_steps.next.has_value());
}

TEST(FollowUpSteps, ACommitInBetweenIsAConflict) {
  SceneDatabase scene;
  Prepare(&scene, false);
  Retrieval retrieval({});
  const IngestOptions options = Options();
  CityMap map;
  const IngestParts parts{scene.database(), &retrieval, scene.features(),
                          scene.pool(),     options,    &map};
  WriteScope scope = BeginWrite(scene.database());
  const auto other = scene.database()->BeginTransaction();
  other->PutState(scene.State());
  ASSERT_OK(other->Commit());
  const auto retried = RetryPhoto(parts, ImageId(4), std::move(scope));
  EXPECT_EQ(retried.status().code(), StatusCode::kBusy);
  EXPECT_FALSE(scene.Snap()->FindPose(ImageId(4))->has_value());
  map.Clear();
  EXPECT_OK(RetryPhoto(parts, ImageId(4), BeginWrite(scene.database())).status());
  EXPECT_TRUE(scene.Snap()->FindPose(ImageId(4))->has_value());
}

TEST(FollowUpSteps, AFailedAdjustmentLeavesNoPointBlocks) {
  SceneDatabase scene;
  Prepare(&scene, false);
  Retrieval retrieval({});
  const IngestOptions options = Options();
  CityMap map;
  const IngestParts parts{scene.database(), &retrieval, scene.features(),
                          scene.pool(),     options,    &map};
  const ReconstructionRecord before = *scene.Snap()->GetReconstruction(ReconstructionId(1));
  const auto count_blocks = [&](uint32_t generation) {
    size_t count = 0;
    EXPECT_OK(scene.Snap()->ScanPointBlocks(before.id, generation,
                                            [&](const PointBlock&) { return ++count, true; }));
    return count;
  };
  WriteScope scope = BeginWrite(scene.database());
  const auto other = scene.database()->BeginTransaction();
  other->PutState(scene.State());
  ASSERT_OK(other->Commit());
  EXPECT_EQ(AdjustWhole(parts, before.id, std::move(scope)).status().code(), StatusCode::kBusy);
  EXPECT_EQ(count_blocks(before.points_generation + 1), 0u);
  map.Clear();
  ASSERT_OK(AdjustWhole(parts, before.id, BeginWrite(scene.database())).status());
  EXPECT_GT(count_blocks(before.points_generation + 1), 0u);
  EXPECT_EQ(count_blocks(before.points_generation), 0u);
}

}  // namespace
}  // namespace veduta
