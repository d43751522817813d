// SPDX-License-Identifier: Apache-2.0
// Goal: the adjustment of a large reconstruction that is computed without a turn gives the same
//   database as one in a turn where nothing came between; what came between is carried over with
//   it: photos stay placed, poses get right, images lose their poses and parts are split off; one
//   without submaps gets them then, and not otherwise; what is gone stays as it is; nothing is
//   written before the commit.
// Method: synthetic scenes in a database, in submaps that are set by hand, and changes between the
//   computation and the commit.
#include "engine/ingest/large_adjustment.h"

#include <gtest/gtest.h>

#include <numeric>

#include "engine/ingest/forbidding.h"
#include "engine/ingest/ingest.h"
#include "tests/engine/ingest/parted_scene.h"
#include "tests/engine/ingest/torn_scene.h"

namespace veduta {
namespace {

// Above seven images the whole is adjusted, and it has submaps.
IngestOptions WholeParts() {
  IngestOptions options = SmallParts();
  options.schedule.whole_again_images_max = 100;
  return options;
}

const DueStep kWhole{FollowUpKind::kAdjustment, {}, kCity, {}, {}, true};

struct Worker {
  Worker(SceneDatabase* in, IngestOptions with) : scene(*in), options(std::move(with)) {}

  LargeAdjustment Adjustment() {
    return LargeAdjustment(
        {scene.database(), &retrieval, scene.features(), scene.pool(), options, nullptr}, kCity);
  }
  // What a scheduler does: large adjustments without a turn, everything else in one.
  void RunAll() {
    for (size_t steps = 0;;) {
      LongSteps long_steps;
      const auto step = ingest.RunNextStep(&long_steps);
      if (!step && !long_steps.next) return;
      ASSERT_LT(++steps, 30u);
      if (step) {
        ASSERT_OK(step->status);
        continue;
      }
      LargeAdjustment adjustment = Adjustment();
      ASSERT_OK(adjustment.Compute());
      ASSERT_OK(ingest.Commit(&adjustment, kCity).status);
    }
  }
  std::vector<SubmapRecord> Submaps() const { return *scene.Snap()->ListSubmaps(); }
  ReconstructionRecord City() const { return *scene.Snap()->GetReconstruction(kCity); }

  SceneDatabase& scene;
  const IngestOptions options;
  Retrieval retrieval{{}};
  Ingest ingest{scene.database(), &retrieval, scene.features(), scene.pool(), options};
};

void Pend(SceneDatabase* scene, ImageId image) {
  const auto transaction = scene->database()->BeginTransaction();
  DatabaseState state = scene->State();
  state.pending_propagation = {image};
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
}

void PutRecord(SceneDatabase* scene, const ReconstructionRecord& record) {
  const auto transaction = scene->database()->BeginTransaction();
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
}

TEST(LargeAdjustment, GivesWhatAnAdjustmentInATurnGives) {
  for (const IngestOptions& options : {WholeParts(), SmallParts()}) {
    std::string digests[2];
    for (const bool without_turn : {false, true}) {
      SceneDatabase scene(kArc);
      AddArc(&scene);
      SetDrift(&scene);
      Worker worker(&scene, options);
      if (without_turn) {
        worker.RunAll();
      } else {
        while (const auto step = worker.ingest.RunNextStep()) ASSERT_OK(step->status);
      }
      ExpectSound(scene);
      EXPECT_LT(WorstCenter(scene), 0.01) << "it was 0.06";
      EXPECT_EQ(worker.City().images_at_adjustment, 12u);
      digests[without_turn] = DigestHex(scene);
    }
    EXPECT_EQ(digests[0], digests[1]);
  }
}

// Photos have told the camera wrongly; another reconstruction that has it, too, refines it while
// the whole is adjusted with a refinement of its own, and leaves the images a camera as it was.
TEST(LargeAdjustment, ALensThatWasRefinedMeanwhileStays) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  Worker worker(&scene, WholeParts());
  CameraRecord camera = *scene.Snap()->GetCamera(SceneDatabase::ImageCamera());
  camera.is_refinable = true;
  camera.model.fx *= 0.97, camera.model.fy *= 0.97;
  ReconstructionRecord city = worker.City();
  city.images_at_adjustment = 11;
  const auto prepared = scene.database()->BeginTransaction();
  prepared->PutCamera(camera);
  prepared->PutReconstruction(city);
  ASSERT_OK(prepared->Commit());
  LargeAdjustment adjustment = worker.Adjustment();
  ASSERT_OK(adjustment.Compute());

  const auto meanwhile = scene.database()->BeginTransaction();
  DatabaseState state = scene.State();
  CameraRecord kept = camera, refined = camera;
  kept.id = CameraId(state.next_camera++);
  kept.name += " (2)";
  refined.model.fx *= 1.02, refined.model.fy *= 1.02;
  meanwhile->PutCamera(kept);
  meanwhile->PutCamera(refined);
  for (uint32_t i = 1; i <= 12; ++i) {
    ImageRecord image = *scene.Snap()->GetImage(ImageId(i));
    image.camera = kept.id;
    meanwhile->PutImage(image);
  }
  meanwhile->PutState(state);
  ASSERT_OK(meanwhile->Commit());
  ASSERT_OK(worker.ingest.Commit(&adjustment, kCity).status);
  EXPECT_EQ(scene.Snap()->GetCamera(refined.id)->model, refined.model);
  EXPECT_EQ(scene.Snap()->GetCamera(kept.id)->model, kept.model);
  EXPECT_EQ(scene.Snap()->GetImage(ImageId(3))->camera, kept.id);
}

// The last camera gets its pose while the whole is adjusted, whose last submap has drifted.
TEST(LargeAdjustment, APhotoThatCameMeanwhileIsCarriedAlong) {
  SceneDatabase scene(kArc);
  AddArc(&scene, 11);
  SetDrift(&scene);
  Worker worker(&scene, WholeParts());
  ASSERT_OK(worker.ingest.RunNextStep()->status);  // the motion
  const double before = WorstCenter(scene);
  EXPECT_GT(before, 0.02);
  Pend(&scene, ImageId(12));
  LargeAdjustment adjustment = worker.Adjustment();
  const uint64_t sequence = scene.State().next_journal;
  ASSERT_OK(adjustment.Compute());
  EXPECT_EQ(scene.State().next_journal, sequence) << "nothing is written yet";
  LongSteps long_steps{kWhole, false, {}};
  const auto placed = worker.ingest.RunNextStep(&long_steps);
  ASSERT_TRUE(placed.has_value());
  EXPECT_EQ(placed->placed, std::vector{ImageId(12)});
  EXPECT_FALSE(worker.ingest.RunNextStep(&long_steps).has_value()) << "all else waits";
  EXPECT_FALSE(long_steps.next.has_value());
  ASSERT_OK(worker.ingest.Commit(&adjustment, kCity).status);
  ExpectSound(scene);
  EXPECT_EQ(worker.City().images_at_adjustment, 11u);
  for (const SubmapRecord& submap : worker.Submaps())
    EXPECT_TRUE(submap.motion.has_value()) << submap.id.value;
  EXPECT_EQ(worker.Submaps().back().images_at_adjustment, 0u) << "it has a photo more";
  for (size_t submap = 0; submap < 3; ++submap) {
    const auto moved = worker.ingest.RunNextStep();
    ASSERT_TRUE(moved.has_value());
    ASSERT_OK(moved->status);
    ExpectSound(scene);
  }
  EXPECT_LT(WorstCenter(scene), before / 5) << "the motions alone bring it near";
  worker.RunAll();
  ExpectSound(scene);
  EXPECT_EQ(worker.City().image_count, 12u);
  EXPECT_LT(WorstCenter(scene), 0.005);
}

// All cameras but the last are in a reconstruction without submaps, and one of them stands wrong.
void AddWithoutSubmaps(SceneDatabase* scene) {
  AddArc(scene, 11);
  const auto transaction = scene->database()->BeginTransaction();
  for (const uint32_t submap : {1u, 2u, 3u}) transaction->DeleteSubmap(SubmapId(submap));
  PoseRecord pose = **scene->Snap()->FindPose(ImageId(4));
  pose.cam_from_world.translation.x() += 0.02;
  transaction->PutPose(pose);
  ASSERT_OK(transaction->Commit());
  Pend(scene, ImageId(12));
}

TEST(LargeAdjustment, OneWithoutSubmapsGetsThemWhereOthersCameMeanwhile) {
  IngestOptions options = WholeParts();
  options.schedule.whole_images_max = 100;
  options.mapper.local_images_max = 3;  // the photo that comes moves the wrong one no more
  SceneDatabase scene(kArc);
  AddWithoutSubmaps(&scene);
  Worker worker(&scene, options);
  LargeAdjustment adjustment = worker.Adjustment();
  ASSERT_OK(adjustment.Compute());
  LongSteps long_steps{kWhole, false, {}};
  const auto placed = worker.ingest.RunNextStep(&long_steps);
  ASSERT_TRUE(placed.has_value());
  EXPECT_EQ(placed->placed, std::vector{ImageId(12)});
  EXPECT_FALSE(worker.ingest.RunNextStep(&long_steps).has_value()) << "all else waits";
  ASSERT_OK(worker.ingest.Commit(&adjustment, kCity).status);
  ExpectSound(scene);
  EXPECT_EQ(worker.City().images_at_adjustment, 11u);
  size_t images = 0, due = 0;
  for (const SubmapRecord& submap : worker.Submaps()) {
    images += submap.images.size();
    due += submap.images_at_adjustment == 0 ? 1 : 0;
    EXPECT_TRUE(submap.motion.has_value()) << submap.id.value;
  }
  EXPECT_EQ(images, 12u);
  EXPECT_GE(due, 2u) << "that of the photo that came, and of the one that stands wrong";
  EXPECT_GT(WorstCenter(scene), 0.01);
  worker.RunAll();
  ExpectSound(scene);
  EXPECT_EQ(worker.City().image_count, 12u);
  EXPECT_LT(WorstCenter(scene), 0.005);
}

TEST(LargeAdjustment, OneWithoutSubmapsGetsNoneWhereNobodyCame) {
  IngestOptions options = WholeParts();
  options.schedule.whole_images_max = 100;
  std::string digests[2];
  for (const bool without_turn : {false, true}) {
    SceneDatabase scene(kArc);
    AddWithoutSubmaps(&scene);
    Worker worker(&scene, options);
    if (without_turn) {
      worker.RunAll();
    } else {
      while (const auto step = worker.ingest.RunNextStep()) ASSERT_OK(step->status);
    }
    ExpectSound(scene);
    EXPECT_TRUE(worker.Submaps().empty());
    EXPECT_LT(WorstCenter(scene), 0.005);
    digests[without_turn] = DigestHex(scene);
  }
  EXPECT_EQ(digests[0], digests[1]);
}

TEST(LargeAdjustment, WhatIsMergedAwayStaysAsItIs) {
  for (const bool before_it_began : {true, false}) {
    SceneDatabase scene(kArc);
    AddArc(&scene);
    Worker worker(&scene, WholeParts());
    LargeAdjustment adjustment = worker.Adjustment();
    if (!before_it_began) {
      ASSERT_OK(adjustment.Compute());
    }
    ReconstructionRecord record = worker.City();
    record.merged_into = ReconstructionId(7);
    PutRecord(&scene, record);
    if (before_it_began) {
      ASSERT_OK(adjustment.Compute());
    }
    const std::string digest = DigestHex(scene);
    ASSERT_OK(worker.ingest.Commit(&adjustment, kCity).status);
    EXPECT_EQ(DigestHex(scene), digest);
  }
}

TEST(LargeAdjustment, WhatIsCarriedOverMakesHypothesesDue) {
  for (const bool changes_meanwhile : {false, true}) {
    SceneDatabase scene(kArc);
    AddArc(&scene, 9);
    const ReconstructionId other = scene.AddReconstruction({9, 10, 11});
    const auto transaction = scene.database()->BeginTransaction();
    HypothesisRecord hypothesis;
    hypothesis.a = kCity, hypothesis.b = other;
    hypothesis.reason = RefusalReason::kSplit;
    hypothesis.images = {ImageId(9)};
    transaction->PutHypothesis(hypothesis);
    ReconstructionRecord record = *scene.Snap()->GetReconstruction(kCity);
    record.images_at_adjustment = 5;
    transaction->PutReconstruction(record);
    ASSERT_OK(transaction->Commit());
    Worker worker(&scene, WholeParts());
    LargeAdjustment adjustment = worker.Adjustment();
    ASSERT_OK(adjustment.Compute());
    ++record.geometry_version;
    if (changes_meanwhile) PutRecord(&scene, record);
    ASSERT_OK(worker.ingest.Commit(&adjustment, kCity).status);
    const auto hypotheses = *scene.Snap()->ListHypotheses();
    ASSERT_EQ(hypotheses.size(), 1u);
    EXPECT_TRUE(hypotheses.front().is_due);
    EXPECT_EQ(worker.City().images_at_adjustment, 9u);
  }
}

TEST(LargeAdjustment, OneThatBecameDueAnewStaysDue) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  Worker worker(&scene, WholeParts());
  ReconstructionRecord record = worker.City();
  record.images_at_adjustment = 5;
  PutRecord(&scene, record);
  LargeAdjustment adjustment = worker.Adjustment();
  ASSERT_OK(adjustment.Compute());
  record.images_at_adjustment = 0;  // somebody has forbidden a pair
  PutRecord(&scene, record);
  ASSERT_OK(worker.ingest.Commit(&adjustment, kCity).status);
  EXPECT_EQ(worker.City().images_at_adjustment, 0u);
  ExpectSound(scene);
}

// It was due already, so that the removal cannot make it due.
TEST(LargeAdjustment, APhotoThatIsRemovedMeanwhileMakesItDueAnew) {
  SceneDatabase scene(kArc);
  std::vector<uint32_t> all(12);
  std::iota(all.begin(), all.end(), 0);
  scene.AddImages(0, 12);
  scene.AddReconstruction(all);
  Worker worker(&scene, WholeParts());
  ReconstructionRecord record = worker.City();
  record.images_at_adjustment = 0;
  PutRecord(&scene, record);
  LargeAdjustment adjustment = worker.Adjustment();
  ASSERT_OK(adjustment.Compute());
  ASSERT_OK(worker.ingest.Remove(ImageId(6), "bea", ""));
  ASSERT_OK(worker.ingest.Commit(&adjustment, kCity).status);
  EXPECT_EQ(worker.City().images_at_adjustment, 0u);
  EXPECT_EQ(worker.City().image_count, 11u);
  ExpectSound(scene);
}

// It was due by a pair that was forbidden before, and another one is forbidden meanwhile.
TEST(LargeAdjustment, WhatIsForbiddenMeanwhileMakesItDueAnew) {
  for (const IngestOptions& options : {WholeParts(), SmallParts()}) {
    SceneDatabase scene(kArc);
    AddArc(&scene);
    Worker worker(&scene, options);
    LargeAdjustment adjustment = worker.Adjustment();
    ASSERT_OK(adjustment.Compute());
    ForbiddenRecord forbidden;
    forbidden.a = 1, forbidden.b = 2;
    ASSERT_OK(Forbid(forbidden, BeginWrite(scene.database())));
    ASSERT_OK(worker.ingest.Commit(&adjustment, kCity).status);
    EXPECT_EQ(worker.City().images_at_adjustment, 0u);
    ExpectSound(scene);
  }
}

// Two sides that contradict each other, in submaps of two.
void AddTornSubmaps(SceneDatabase* scene) {
  ASSERT_EQ(AddTwoSides(scene), kCity);
  ContradictSeam(scene);
  const auto transaction = scene->database()->BeginTransaction();
  for (const uint32_t half : {0u, 1u, 2u, 3u}) {
    const std::vector<ImageId> side = SideImages(half / 2);
    transaction->PutSubmap(
        {SubmapId(half + 1), kCity, {side[half % 2 * 2], side[half % 2 * 2 + 1]}, 2});
  }
  ReconstructionRecord record = *scene->Snap()->GetReconstruction(kCity);
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
}

TEST(LargeAdjustment, APartIsSplitOffThoughOthersCameMeanwhile) {
  for (const bool changes_meanwhile : {false, true}) {
    SceneDatabase scene(kTwoSides);
    AddTornSubmaps(&scene);
    Worker worker(&scene, WholeParts());
    LargeAdjustment adjustment = worker.Adjustment();
    ASSERT_OK(adjustment.Compute());
    if (changes_meanwhile) {
      ReconstructionRecord record = worker.City();
      ++record.geometry_version;
      PutRecord(&scene, record);
    }
    const FollowUp done = worker.ingest.Commit(&adjustment, kCity);
    ASSERT_OK(done.status);
    ExpectSound(scene);
    ASSERT_EQ(done.split_off.size(), 1u);
    EXPECT_EQ(worker.City().image_count, 4u);
    EXPECT_EQ(scene.Snap()->GetReconstruction(done.split_off.front())->image_count, 4u);
    EXPECT_EQ(scene.Snap()->ListHypotheses()->size(), 1u) << "the seam";
    EXPECT_EQ(worker.Submaps().size(), 2u) << "what was split off has none";
    worker.RunAll();
    ExpectSound(scene);
  }
}

// What is to be split off has gone meanwhile but for one image.
TEST(LargeAdjustment, WhatIsLeftOfAPartIsPassedOver) {
  SceneDatabase scene(kTwoSides);
  AddTornSubmaps(&scene);
  Worker worker(&scene, WholeParts());
  LargeAdjustment first = worker.Adjustment(), second = worker.Adjustment();
  ASSERT_OK(first.Compute());
  ASSERT_OK(second.Compute());
  const FollowUp done = worker.ingest.Commit(&first, kCity);
  ASSERT_OK(done.status);
  ASSERT_EQ(done.split_off.size(), 1u);
  const FollowUp again = worker.ingest.Commit(&second, kCity);
  ASSERT_OK(again.status);
  EXPECT_TRUE(again.split_off.empty());
  ExpectSound(scene);
}

TEST(LargeAdjustment, OneThatIsNotThereIsAnError) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  Worker worker(&scene, WholeParts());
  LargeAdjustment adjustment({scene.database(), &worker.retrieval, scene.features(), scene.pool(),
                              worker.options, nullptr},
                             ReconstructionId(9));
  EXPECT_EQ(adjustment.Compute().code(), StatusCode::kNotFound);
  EXPECT_EQ(worker.ingest.Commit(&adjustment, ReconstructionId(9)).status.code(),
            StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
