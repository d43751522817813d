// SPDX-License-Identifier: Apache-2.0
// Goal: the next due step is read from the state: waiting photos first, then adjustments, then the
//   vocabulary; steps set aside are passed over; what must wait for a long step that is at work
//   does.
// Method: a synthetic scene in a database whose state is set by hand.
#include "engine/ingest/due_work.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

TEST(DueWork, AdjustmentsFollowTheGrowth) {
  const AdjustmentSchedule schedule{.views_step = 3,
                                    .growth_share = 0.1,
                                    .long_growth_share = 0.25,
                                    .region_images_max = 48,
                                    .whole_again_share = 0.2,
                                    .relaxation_share = 0.1};
  ReconstructionRecord record;
  record.id = ReconstructionId(1);
  EXPECT_FALSE(IsAdjustmentDue(record, false, schedule)) << "an empty one";
  record.image_count = 3;
  EXPECT_TRUE(IsAdjustmentDue(record, false, schedule)) << "never adjusted, or merged since";
  record.images_at_adjustment = 3;
  record.image_count = 5;
  EXPECT_FALSE(IsAdjustmentDue(record, false, schedule));
  record.image_count = 6;
  EXPECT_TRUE(IsAdjustmentDue(record, false, schedule));
  record.images_at_adjustment = 40;
  record.image_count = 43;
  EXPECT_FALSE(IsAdjustmentDue(record, false, schedule)) << "a tenth is more than three images";
  record.image_count = 44;
  EXPECT_TRUE(IsAdjustmentDue(record, false, schedule));
  record.image_count = 49;
  EXPECT_FALSE(IsAdjustmentDue(record, false, schedule)) << "its adjustment would be long";
  record.image_count = 50;
  EXPECT_TRUE(IsAdjustmentDue(record, false, schedule));
  record.images_at_adjustment = 1000;
  record.image_count = 1199;
  EXPECT_FALSE(IsAdjustmentDue(record, true, schedule)) << "its submaps are";
  record.image_count = 1200;
  EXPECT_TRUE(IsAdjustmentDue(record, true, schedule));
  EXPECT_FALSE(IsRelaxed(record, true, schedule));
  record.image_count = 2001;
  EXPECT_TRUE(IsRelaxed(record, true, schedule));
  EXPECT_FALSE(IsRelaxed(record, false, schedule));
  record.images_at_adjustment = 1900;
  EXPECT_FALSE(IsAdjustmentDue(record, true, schedule));
  record.image_count = 2090;
  EXPECT_TRUE(IsAdjustmentDue(record, true, schedule)) << "it is relaxed after a tenth more";
  record.images_at_adjustment = 0;
  EXPECT_TRUE(IsAdjustmentDue(record, true, schedule)) << "somebody has forbidden a pair";
  record.merged_into = ReconstructionId(2);
  EXPECT_FALSE(IsAdjustmentDue(record, false, schedule));
}

TEST(DueWork, StepsComeInTheirOrderAndFailedOnesAreSetAside) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  scene.AddReconstruction({0, 1, 2});
  const ReconstructionId second = scene.AddReconstruction({3, 4});
  const auto transaction = scene.database()->BeginTransaction();
  DatabaseState state = scene.State();
  state.pending_propagation = {ImageId(6), ImageId(5)};
  transaction->PutState(state);
  ReconstructionRecord grown = *scene.Snap()->GetReconstruction(second);
  grown.images_at_adjustment = 0;
  transaction->PutReconstruction(grown);
  HypothesisRecord hypothesis;
  hypothesis.images = {ImageId(1)};
  hypothesis.a = ReconstructionId(1);
  hypothesis.b = second;
  hypothesis.is_due = true;
  transaction->PutHypothesis(hypothesis);
  transaction->PutSubmap({SubmapId(3), ReconstructionId(1), {ImageId(1), ImageId(2)}, 2});
  transaction->PutSubmap({SubmapId(4), ReconstructionId(1), {ImageId(3)}, 0});
  transaction->PutSubmap({SubmapId(5), ReconstructionId(1), {ImageId(4)}, 1, Sim3()});
  hypothesis.b = ReconstructionId(7);
  hypothesis.is_due = false;
  transaction->PutHypothesis(hypothesis);
  transaction->PutGroundPoint({"corner", {47, 15, 300}, 0.05, {}});
  ASSERT_OK(transaction->Commit());

  const Retrieval retrieval({.compare_all_max = 6});
  StepsSetAside set_aside;
  const auto next = [&]() -> std::optional<DueStep> {
    auto step = FindDueStep(*scene.Snap(), {}, retrieval, set_aside);
    EXPECT_OK(step);
    return step.ok() ? *step : std::nullopt;
  };
  const DueStep expected[] = {{FollowUpKind::kPropagation, ImageId(6), {}},
                              {FollowUpKind::kPropagation, ImageId(5), {}},
                              {FollowUpKind::kAdjustment, {}, ReconstructionId(1), {}, SubmapId(5)},
                              {FollowUpKind::kAdjustment, {}, ReconstructionId(1), {}, SubmapId(4)},
                              {FollowUpKind::kAdjustment, {}, second},
                              {FollowUpKind::kJudgment, {}, ReconstructionId(1), second},
                              {FollowUpKind::kGeoreference, {}, ReconstructionId(1)},
                              {FollowUpKind::kGeoreference, {}, second},
                              {FollowUpKind::kVocabulary, {}, {}}};
  for (const DueStep& step : expected) {
    const auto due = next();
    ASSERT_TRUE(due.has_value());
    EXPECT_EQ(due->kind, step.kind);
    EXPECT_EQ(due->image, step.image);
    EXPECT_EQ(due->reconstruction, step.reconstruction);
    EXPECT_EQ(due->other, step.other);
    EXPECT_EQ(due->submap, step.submap);
    EXPECT_FALSE(set_aside.Contains(step));
    set_aside.Add(step);
    EXPECT_TRUE(set_aside.Contains(step));
  }
  EXPECT_FALSE(next().has_value());
}

TEST(DueWork, WhatWaitsForALongStepIsPassedOver) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  const ReconstructionId first = scene.AddReconstruction({0, 1, 2});
  const ReconstructionId second = scene.AddReconstruction({3, 4, 5});
  const auto transaction = scene.database()->BeginTransaction();
  for (const ReconstructionId id : {first, second}) {
    ReconstructionRecord record = *scene.Snap()->GetReconstruction(id);
    record.images_at_adjustment = 0;
    transaction->PutReconstruction(record);
  }
  transaction->PutSubmap({SubmapId(1), first, {ImageId(1)}, 0});
  transaction->PutSubmap({SubmapId(2), first, {ImageId(2), ImageId(3)}, 1, Sim3()});
  transaction->PutSubmap({SubmapId(3), second, {ImageId(4), ImageId(5), ImageId(6)}, 0});
  ASSERT_OK(transaction->Commit());
  const Retrieval retrieval({.compare_all_max = 3});
  StepsSetAside set_aside;
  const auto next = [&](const std::optional<DueStep>& at_work) {
    return FindDueStep(*scene.Snap(), {}, retrieval, set_aside, at_work)->value_or(DueStep());
  };
  const DueStep motion = next({});
  EXPECT_EQ(motion.submap, SubmapId(2)) << "a motion comes before the whole";
  EXPECT_FALSE(motion.is_long);
  set_aside.Add(motion);
  const DueStep whole = next({});
  EXPECT_EQ(whole.reconstruction, first);
  EXPECT_FALSE(whole.submap.valid());
  EXPECT_TRUE(whole.is_long);
  const DueStep beside = next(whole);
  EXPECT_EQ(beside.submap, SubmapId(3)) << "the whole of the other waits, and its submap does not";
  set_aside.Add(beside);
  EXPECT_FALSE(FindDueStep(*scene.Snap(), {}, retrieval, set_aside, whole)->has_value());
  set_aside.Add(whole);
  set_aside.Add({FollowUpKind::kAdjustment, {}, first, {}, SubmapId(1)});
  set_aside.Add({FollowUpKind::kAdjustment, {}, second});
  const DueStep training = next({});
  EXPECT_EQ(training.kind, FollowUpKind::kVocabulary);
  EXPECT_TRUE(training.is_long);
}

// Above a group of submaps it is long; above the bound for parting it is short again.
TEST(DueWork, TheWholeOfAMiddlingReconstructionIsLong) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  const ReconstructionId city = scene.AddReconstruction({0, 1, 2, 3, 4, 5});
  const auto transaction = scene.database()->BeginTransaction();
  ReconstructionRecord record = *scene.Snap()->GetReconstruction(city);
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  const Retrieval retrieval({});
  AdjustmentSchedule schedule;
  schedule.submap_images_max = schedule.submap_images_min = 3;
  for (const auto& [region, whole, is_long] :
       {std::tuple(6u, 6u, false), {5u, 6u, true}, {3u, 5u, false}}) {
    schedule.region_images_max = region;
    schedule.whole_images_max = whole;
    ASSERT_OK(schedule.Check());
    const auto step = *FindDueStep(*scene.Snap(), schedule, retrieval, {});
    ASSERT_TRUE(step.has_value());
    EXPECT_EQ(step->reconstruction, city);
    EXPECT_EQ(step->is_long, is_long) << region << " " << whole;
    EXPECT_EQ(FindLongStep(*scene.Snap(), schedule, retrieval, {})->has_value(), is_long);
    const DueStep at_work{FollowUpKind::kAdjustment, {}, city, {}, {}, true};
    EXPECT_FALSE(FindDueStep(*scene.Snap(), schedule, retrieval, {}, at_work)->has_value())
        << "neither is it parted while all of it is adjusted";
  }
}

TEST(DueWork, ALongStepIsFoundBehindOthers) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  const ReconstructionId city = scene.AddReconstruction({0, 1, 2});
  const auto put = [&](std::vector<ImageId> pending, std::optional<Sim3> motion) {
    const auto transaction = scene.database()->BeginTransaction();
    DatabaseState state = scene.State();
    state.pending_propagation = std::move(pending);
    transaction->PutState(state);
    ReconstructionRecord record = *scene.Snap()->GetReconstruction(city);
    record.images_at_adjustment = 0;
    transaction->PutReconstruction(record);
    transaction->PutSubmap({SubmapId(1), city, {ImageId(1), ImageId(2), ImageId(3)}, 0, motion});
    ASSERT_OK(transaction->Commit());
  };
  const Retrieval retrieval({.compare_all_max = 3});
  StepsSetAside set_aside;
  const auto find = [&]() -> std::optional<DueStep> {
    const auto found = FindLongStep(*scene.Snap(), {}, retrieval, set_aside);
    EXPECT_OK(found);
    return found.ok() ? *found : std::nullopt;
  };
  put({ImageId(4)}, Sim3());
  ASSERT_TRUE(find().has_value());
  EXPECT_EQ(find()->kind, FollowUpKind::kVocabulary);
  set_aside.Add(*find());
  EXPECT_FALSE(find().has_value()) << "a motion comes before the whole";
  put({ImageId(4)}, std::nullopt);
  ASSERT_TRUE(find().has_value()) << "a photo that waits does not";
  EXPECT_EQ(find()->reconstruction, city);
  EXPECT_FALSE(find()->submap.valid());
  set_aside.Add(*find());
  EXPECT_FALSE(find().has_value());
}

}  // namespace
}  // namespace veduta
