// SPDX-License-Identifier: Apache-2.0
// Goal: taking a pose leaves the image's own record to the caller, returns the images that cannot
//   stand without it, which wait with the reason that was given, and takes the hypotheses of a
//   reconstruction of which nothing is left, and of no other.
// Method: a synthetic scene in a database; one pose is taken in one transaction.
#include "engine/ingest/pose_removal.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

constexpr ReconstructionId kWhole(1), kOther(9);

// Takes the pose of image 1, beside a hypothesis about its reconstruction. Returns the others.
std::vector<ImageId> TakeFirst(SceneDatabase* scene) {
  auto transaction = scene->database()->BeginTransaction();
  HypothesisRecord hypothesis;
  hypothesis.a = kWhole;
  hypothesis.b = kOther;
  hypothesis.images = {ImageId(2)};
  transaction->PutHypothesis(hypothesis);
  EXPECT_OK(transaction->Commit());
  CityMap map;
  Retrieval retrieval({});
  const IngestOptions options;
  const IngestParts parts{scene->database(), &retrieval, scene->features(),
                          scene->pool(),     options,    &map};
  const WriteScope scope = BeginWrite(scene->database());
  DatabaseState state = *scope.base->GetState();
  const PoseRecord pose = **scope.base->FindPose(ImageId(1));
  auto others = RemovePose(parts, scope, pose, "the test wants it", &state);
  EXPECT_OK(others);
  scope.transaction->PutState(state);
  EXPECT_OK(scope.transaction->Commit());
  EXPECT_FALSE(scene->Snap()->FindPose(ImageId(1))->has_value());
  EXPECT_EQ(scene->Snap()->GetImage(ImageId(1))->verdict, Verdict::kFounded) << "the caller's";
  return others.ok() ? *others : std::vector<ImageId>();
}

TEST(PoseRemoval, TheRestStandsByItself) {
  SceneDatabase scene;
  scene.AddImages(0, 5);
  ASSERT_EQ(scene.AddReconstruction({0, 1, 2, 3, 4}), kWhole);
  EXPECT_TRUE(TakeFirst(&scene).empty());
  EXPECT_TRUE(scene.State().pending_propagation.empty());
  EXPECT_EQ(scene.Snap()->GetReconstruction(kWhole)->image_count, 4u);
  EXPECT_EQ(scene.Snap()->ListHypotheses()->size(), 1u);
}

TEST(PoseRemoval, WhatCannotStandWithoutItWaits) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  ASSERT_EQ(scene.AddReconstruction({0, 1, 2}), kWhole);
  const std::vector<ImageId> others = {ImageId(2), ImageId(3)};
  EXPECT_EQ(TakeFirst(&scene), others);
  EXPECT_EQ(scene.State().pending_propagation, others);
  for (const ImageId id : others) {
    EXPECT_FALSE(scene.Snap()->FindPose(id)->has_value());
    EXPECT_EQ(scene.Snap()->GetImage(id)->detail, "the test wants it");
  }
  EXPECT_TRUE(scene.Snap()->GetReconstruction(kWhole)->is_dissolved);
  EXPECT_TRUE(scene.Snap()->ListHypotheses()->empty());
}

}  // namespace
}  // namespace veduta
