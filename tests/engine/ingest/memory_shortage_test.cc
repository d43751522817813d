// SPDX-License-Identifier: Apache-2.0
// Goal: a step of what follows from photos that runs out of memory fails with a status, and the
//   program goes on.
// Method: large pieces of memory are refused for as long as the step runs.
#include <gtest/gtest.h>

#include "engine/ingest/ingest.h"
#include "tests/engine/ingest/scene_database.h"
#include "tests/engine/memory_limit.h"

namespace veduta {
namespace {

// Bytes. Measured by trying: RocksDB asks for pieces of up to 20 to 40 kB in this test, which must
// be granted, and the adjustment asks for one of more than 50 kB.
constexpr size_t kLargestPiece = 50'000;

TEST(MemoryShortage, FailsTheStepAndNothingElse) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3, 4, 5});
  const auto transaction = scene.database()->BeginTransaction();
  ReconstructionRecord grown = *scene.Snap()->GetReconstruction(id);
  grown.images_at_adjustment = 0;
  transaction->PutReconstruction(grown);
  ASSERT_OK(transaction->Commit());
  for (uint32_t image = 1; image <= 6; ++image)
    ASSERT_OK(scene.features()->Get(*scene.Snap(), ImageId(image)));

  Retrieval retrieval{RetrievalOptions()};
  Ingest ingest(scene.database(), &retrieval, scene.features(), scene.pool(), IngestOptions());
  std::optional<FollowUp> step;
  {
    const MemoryLimit limit(kLargestPiece);
    step = ingest.RunNextStep();
  }
  ASSERT_TRUE(step);
  EXPECT_EQ(step->kind, FollowUpKind::kAdjustment);
  EXPECT_EQ(step->status.code(), StatusCode::kNoMemory) << step->status.message();
  EXPECT_FALSE(ingest.RunNextStep()) << "the step is passed over from then on";

  Ingest later(scene.database(), &retrieval, scene.features(), scene.pool(), IngestOptions());
  const std::optional<FollowUp> again = later.RunNextStep();
  ASSERT_TRUE(again);
  EXPECT_OK(again->status);
}

}  // namespace
}  // namespace veduta
