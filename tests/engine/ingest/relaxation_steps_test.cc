// SPDX-License-Identifier: Apache-2.0
// Goal: a large reconstruction is relaxed and judged as its submaps: what they have found across
//   their borders moves them back to where they fit, and splits off a part that lies in none of
//   them alone; each motion is a step of its own that a new process carries out; submaps without a
//   border are adjusted first; `verify` is content all the while, and the digest is the same at any
//   thread count and wherever the process ends.
// Method: synthetic scenes in a database, in submaps that are set by hand.
#include "engine/ingest/relaxation_steps.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/ingest/ingest.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "engine/ingest/submap_borders.h"
#include "engine/ingest/submap_steps.h"
#include "engine/ingest/submaps.h"
#include "tests/engine/ingest/parted_scene.h"
#include "tests/engine/ingest/torn_scene.h"

namespace veduta {
namespace {

struct Worker {
  explicit Worker(SceneDatabase* in) : scene(*in) {}

  IngestParts parts() {
    return {scene.database(), &retrieval, scene.features(), scene.pool(), options, &map};
  }
  Result<AdjustedWhole> Relax() {
    map.Clear();
    return RelaxReconstruction(parts(), kCity, BeginWrite(scene.database()));
  }
  Status Move(uint32_t submap) {
    map.Clear();
    return MoveSubmaps(parts(), kCity, SubmapId(submap), BeginWrite(scene.database()));
  }
  Result<AdjustedWhole> Adjust(uint32_t submap) {
    map.Clear();
    return AdjustSubmap(parts(), kCity, SubmapId(submap), BeginWrite(scene.database()));
  }
  std::vector<SubmapRecord> Submaps() const { return *scene.Snap()->ListSubmaps(); }

  SceneDatabase& scene;
  IngestOptions options = SmallParts();
  Retrieval retrieval{{}};
  CityMap map;
};

// Stores what each submap knows of its neighbours, as its adjustment does.
void StoreBorders(SceneDatabase* scene) {
  const auto transaction = scene->database()->BeginTransaction();
  const auto submaps = Submaps::Read(*scene->Snap());
  ASSERT_OK(submaps);
  for (const SubmapId id : submaps->List(kCity)) {
    SceneWork work(scene);
    const std::vector<ImageId> images = submaps->Find(id)->images;
    const auto region = LoadRegion(work.context, images, true);
    ASSERT_OK(region);
    const auto healing = HealRegion(work.context, images, region->known);
    ASSERT_OK(healing);
    const auto border = FindBorder(work.context, *submaps, id, *healing);
    ASSERT_OK(border);
    EXPECT_GE(border->views.size(), 160u);
    EXPECT_EQ(border->fragments.size(), images.size());
    transaction->PutSubmapBorder(*border);
  }
  ASSERT_OK(transaction->Commit());
}

TEST(RelaxationSteps, AMotionCarriesASubmapWithItsPoints) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  SetDrift(&scene);
  const auto before = scene.Snap();
  Worker worker(&scene);
  EXPECT_EQ(worker.Move(1).code(), StatusCode::kNotFound) << "it is where it should be";
  ASSERT_OK(worker.Move(3));
  ExpectSound(scene);
  EXPECT_FALSE(worker.Submaps().back().motion.has_value());
  for (uint32_t k = 0; k < 12; ++k) {
    const Rigid3 was = (*before->FindPose(ImageId(k + 1)))->cam_from_world;
    const Rigid3 is = (*scene.Snap()->FindPose(ImageId(k + 1)))->cam_from_world;
    const Eigen::Vector3d wanted = k < 8 ? was.Center() : kDrift * was.Center();
    EXPECT_LT((is.Center() - wanted).norm(), 1e-9) << "camera " << k;
  }
  const auto points_of = [](const Snapshot& snapshot, uint32_t home) {
    return snapshot
        .GetPointBlock(kCity, snapshot.GetReconstruction(kCity)->points_generation, ImageId(home))
        ->points;
  };
  for (const uint32_t home : {1u, 9u}) {
    const auto was = points_of(*before, home), is = points_of(*scene.Snap(), home);
    ASSERT_EQ(was.size(), is.size());
    for (size_t i = 0; i < was.size(); ++i) {
      const Eigen::Vector3d wanted = home < 9 ? was[i].position : kDrift * was[i].position;
      EXPECT_LT((is[i].position - wanted).norm(), 1e-9);
    }
  }
}

TEST(RelaxationSteps, SubmapsSideBySideAreMovedTogetherEachByItsOwnMotion) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  SetDrift(&scene);
  const Sim3 other{1, Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.05, 0, 0)};
  const auto transaction = scene.database()->BeginTransaction();
  SubmapRecord middle = (*scene.Snap()->ListSubmaps())[1];
  middle.motion = other;
  transaction->PutSubmap(middle);
  ASSERT_OK(transaction->Commit());
  const auto before = scene.Snap();
  Worker worker(&scene);
  worker.options.schedule.region_images_max = 8;
  ASSERT_OK(worker.Move(2));
  ExpectSound(scene);
  for (const SubmapRecord& submap : worker.Submaps()) EXPECT_FALSE(submap.motion.has_value());
  for (uint32_t k = 0; k < 12; ++k) {
    const Sim3 wanted = k < 4 ? Sim3() : k < 8 ? other : kDrift;
    const Rigid3 was = (*before->FindPose(ImageId(k + 1)))->cam_from_world;
    const Rigid3 is = (*scene.Snap()->FindPose(ImageId(k + 1)))->cam_from_world;
    EXPECT_LT((is.Center() - wanted * was.Center()).norm(), 1e-9) << "camera " << k;
  }
}

TEST(RelaxationSteps, WhatHasDriftedIsMovedBackStepByStep) {
  std::string digest;
  for (const size_t thread_count : {1, 2}) {
    SceneDatabase scene(kArc, thread_count);
    AddArc(&scene);
    StoreBorders(&scene);
    SetDrift(&scene);
    Worker worker(&scene);
    ASSERT_OK(worker.Move(3));
    const double before = WorstCenter(scene);
    EXPECT_GT(before, 0.02);
    ASSERT_OK(worker.Relax());
    for (const SubmapRecord& submap : worker.Submaps())
      EXPECT_TRUE(submap.motion.has_value()) << "the frame is kept by moving all";
    EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->images_at_adjustment, 12u);
    ExpectSound(scene);
    // A new process carries out what the records want, then adjusts, and ends.
    std::optional<Ingest> ingest;
    const auto next_step = [&] {
      const bool is_killed = thread_count == 2 || !ingest.has_value();  // after each step
      if (is_killed)
        ingest.emplace(scene.database(), &worker.retrieval, scene.features(), scene.pool(),
                       worker.options);
      return ingest->RunNextStep();
    };
    for (const uint32_t submap : {1u, 2u, 3u}) {
      const auto step = next_step();
      ASSERT_TRUE(step.has_value());
      ASSERT_OK(step->status);
      EXPECT_FALSE(worker.Submaps()[submap - 1].motion.has_value());
      ExpectSound(scene);
    }
    EXPECT_LT(WorstCenter(scene), before / 10);
    size_t steps = 0;
    while (const auto step = next_step()) {
      ASSERT_OK(step->status);
      ASSERT_LT(++steps, 20u);
    }
    ExpectSound(scene);
    EXPECT_LT(WorstCenter(scene), 0.005);
    if (digest.empty()) digest = DigestHex(scene);
    EXPECT_EQ(DigestHex(scene), digest);
  }
}

TEST(RelaxationSteps, SubmapsThatFitStay) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  StoreBorders(&scene);
  Worker worker(&scene);
  ASSERT_OK(worker.Relax());
  for (const SubmapRecord& submap : worker.Submaps()) {
    EXPECT_FALSE(submap.motion.has_value());
    EXPECT_EQ(submap.images_at_adjustment, 4u);
  }
  EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->images_at_adjustment, 12u);
  ExpectSound(scene);
}

// Without borders all submaps would be due when it comes to be relaxed.
TEST(RelaxationSteps, TheLastAdjustmentOfTheWholeLeavesBorders) {
  for (const uint32_t images_max : {12u, 15u}) {
    std::string digest;
    for (const size_t thread_count : {1, 2}) {
      SceneDatabase scene(kArc, thread_count);
      AddArc(&scene);
      Worker worker(&scene);
      worker.options.schedule.whole_again_images_max = images_max;
      Ingest ingest(scene.database(), &worker.retrieval, scene.features(), scene.pool(),
                    worker.options);
      const auto step = ingest.RunNextStep();
      ASSERT_TRUE(step.has_value());
      ASSERT_OK(step->status);
      for (const SubmapRecord& submap : worker.Submaps()) {
        const auto border = scene.Snap()->FindSubmapBorder(submap.id);
        ASSERT_OK(border);
        ASSERT_EQ(border->has_value(), images_max == 12);
        if (images_max != 12) continue;
        EXPECT_GE((*border)->views.size(), 160u);
        EXPECT_EQ((*border)->fragments.size(), submap.images.size());
        EXPECT_FALSE((*border)->evidence.empty());
      }
      ExpectSound(scene);
      if (digest.empty()) digest = DigestHex(scene);
      EXPECT_EQ(DigestHex(scene), digest);
    }
  }
}

TEST(RelaxationSteps, AnAdjustmentOfTheWholeLeavesNoMotionAndNoOldBorder) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  StoreBorders(&scene);
  SetDrift(&scene);
  Worker worker(&scene);
  worker.options.schedule.whole_again_images_max = 15;
  Ingest ingest(scene.database(), &worker.retrieval, scene.features(), scene.pool(),
                worker.options);
  for (const bool is_motion : {true, false}) {
    const auto step = ingest.RunNextStep();
    ASSERT_TRUE(step.has_value());
    ASSERT_OK(step->status);
    EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->images_at_adjustment, is_motion ? 0u : 12u);
  }
  EXPECT_FALSE(ingest.RunNextStep().has_value());
  ASSERT_EQ(worker.Submaps().size(), 3u);
  for (const SubmapRecord& submap : worker.Submaps()) {
    EXPECT_FALSE(submap.motion.has_value());
    const auto border = scene.Snap()->FindSubmapBorder(submap.id);
    ASSERT_OK(border);
    EXPECT_FALSE(border->has_value());
  }
  ExpectSound(scene);
}

TEST(RelaxationSteps, ADueReconstructionThatHasSubmapsIsRelaxed) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  StoreBorders(&scene);
  SetDrift(&scene);
  Worker worker(&scene);
  ASSERT_OK(worker.Move(3));
  EXPECT_GT(WorstCenter(scene), 0.01);
  Ingest ingest(scene.database(), &worker.retrieval, scene.features(), scene.pool(),
                worker.options);
  while (const auto step = ingest.RunNextStep()) ASSERT_OK(step->status);
  EXPECT_LT(WorstCenter(scene), 0.005);
  size_t relaxations = 0;
  ASSERT_OK(scene.Snap()->ScanJournal(1, [&](const JournalRecord& entry) {
    relaxations += entry.detail == "3 submaps that are moved, 12 images";
    return true;
  }));
  EXPECT_EQ(relaxations, 1u);
  ExpectSound(scene);
}

TEST(RelaxationSteps, SubmapsWithoutABorderAreAdjustedFirst) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  Worker worker(&scene);
  ASSERT_OK(worker.Relax());
  for (const SubmapRecord& submap : worker.Submaps()) EXPECT_EQ(submap.images_at_adjustment, 0u);
  EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->images_at_adjustment, 0u) << "still due";
  // Those that cannot be adjusted hold nothing up.
  ASSERT_OK(worker.Relax());
  EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->images_at_adjustment, 12u);
  ExpectSound(scene);
}

TEST(RelaxationSteps, APartOfSeveralSubmapsThatIsContradictedIsSplitOff) {
  std::string digest;
  for (const size_t thread_count : {1, 2}) {
    SceneDatabase scene(kTwoSides, thread_count);
    ASSERT_EQ(AddTwoSides(&scene), kCity);
    ContradictSeam(&scene);
    Worker worker(&scene);
    worker.options.schedule.region_images_max = 2;  // each submap by itself
    const auto transaction = scene.database()->BeginTransaction();
    for (const uint32_t half : {0u, 1u, 2u, 3u}) {
      const std::vector<ImageId> side = SideImages(half / 2);
      transaction->PutSubmap(
          {SubmapId(half + 1), kCity, {side[half % 2 * 2], side[half % 2 * 2 + 1]}, 0});
    }
    ASSERT_OK(transaction->Commit());
    for (const uint32_t submap : {1u, 2u, 3u, 4u}) {
      const auto adjusted = worker.Adjust(submap);
      ASSERT_OK(adjusted);
      EXPECT_TRUE(adjusted->split_off.empty()) << "no side lies in one submap";
    }
    // They may only have drifted, so they are moved first.
    const auto moved_first = worker.Relax();
    ASSERT_OK(moved_first);
    EXPECT_TRUE(moved_first->split_off.empty());
    EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->images_at_adjustment, 0u) << "to be judged";
    for (const uint32_t submap : {1u, 2u, 3u, 4u}) {
      EXPECT_TRUE(worker.Submaps()[submap - 1].motion.has_value());
      ASSERT_OK(worker.Move(submap));
    }
    for (const uint32_t submap : {1u, 2u, 3u, 4u}) ASSERT_OK(worker.Adjust(submap));
    ExpectSound(scene);
    const auto relaxed = worker.Relax();
    ASSERT_OK(relaxed);
    ASSERT_EQ(relaxed->split_off.size(), 1u);
    ExpectSound(scene);
    const ReconstructionId part = relaxed->split_off.front();
    EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->image_count, 4u);
    EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->images_at_adjustment, 0u) << "due again";
    std::vector<ImageId> moved;
    ASSERT_OK(scene.Snap()->ScanPoses([&](const PoseRecord& pose) {
      if (pose.reconstruction == part) moved.push_back(pose.image);
      return true;
    }));
    EXPECT_TRUE(moved == SideImages(0) || moved == SideImages(1));
    EXPECT_EQ(worker.Submaps().size(), 2u) << "what was split off has no submaps";
    for (const SubmapRecord& submap : worker.Submaps()) EXPECT_EQ(submap.images_at_adjustment, 0u);
    ASSERT_EQ(scene.Snap()->ListHypotheses()->size(), 1u);
    if (digest.empty()) digest = DigestHex(scene);
    EXPECT_EQ(DigestHex(scene), digest);
  }
}

}  // namespace
}  // namespace veduta
