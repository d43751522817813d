// SPDX-License-Identifier: Apache-2.0
// Goal: a reconstruction that has grown too large is parted, and its submaps are adjusted one by
//   one: each pose gets better and nothing outside of the submap's surroundings is written
//   (WriteRegion); one that is too large is parted, one that is too small joins another; what is
//   contradicted is cut off or loses its pose; `verify` is content all the while, and the digest is
//   the same at any thread count.
// Method: synthetic scenes in a database, with bounds small enough for a dozen cameras.
#include "engine/ingest/submap_steps.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/ingest/ingest.h"
#include "engine/ingest/submaps.h"
#include "tests/engine/ingest/torn_scene.h"

namespace veduta {
namespace {

constexpr ReconstructionId kCity(1);

// Parts of four images at most in reconstructions of more than seven.
IngestOptions SmallParts() {
  IngestOptions options;
  options.schedule.whole_images_max = 7;
  options.schedule.submap_images_max = 4;
  options.schedule.submap_images_min = 2;
  options.schedule.region_images_max = 4;
  return options;
}

// All that a step works on.
struct Worker {
  explicit Worker(SceneDatabase* in) : scene(*in) {}

  IngestParts parts() {
    return {scene.database(), &retrieval, scene.features(), scene.pool(), options, &map};
  }
  Status Part() {
    map.Clear();
    return PartReconstruction(parts(), kCity, BeginWrite(scene.database()));
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

// Twelve cameras in one reconstruction, whose whole is due.
constexpr SceneOptions kArc{.camera_count = 12, .point_count = 500, .arc_deg = 60};

void AddArc(SceneDatabase* scene) {
  scene->AddImages(0, 12);
  std::vector<uint32_t> all(12);
  for (uint32_t k = 0; k < 12; ++k) all[k] = k;
  ASSERT_EQ(scene->AddReconstruction(all), kCity);
  const auto transaction = scene->database()->BeginTransaction();
  ReconstructionRecord record = *scene->Snap()->GetReconstruction(kCity);
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
}

// Moves a pose by so much to the side.
void Displace(SceneDatabase* scene, uint32_t k, double by) {
  const auto transaction = scene->database()->BeginTransaction();
  PoseRecord pose = **scene->Snap()->FindPose(ImageId(k + 1));
  pose.cam_from_world.translation.x() += by;
  transaction->PutPose(pose);
  ASSERT_OK(transaction->Commit());
}

double CenterError(const SceneDatabase& scene, uint32_t k) {
  const auto pose = *scene.Snap()->FindPose(ImageId(k + 1));
  return (pose->cam_from_world.Center() - scene.scene().poses[k].Center()).norm();
}

TEST(SubmapSteps, ALargeReconstructionIsPartedAndAdjustedPieceByPiece) {
  std::string digest;
  for (const size_t thread_count : {1, 2}) {
    SceneDatabase scene(kArc, thread_count);
    scene.LimitTracks(2);
    AddArc(&scene);
    Displace(&scene, 5, 0.01);
    Worker worker(&scene);
    Ingest ingest(scene.database(), &worker.retrieval, scene.features(), scene.pool(),
                  worker.options);
    const auto parted = ingest.RunNextStep();
    ASSERT_TRUE(parted.has_value());
    EXPECT_EQ(parted->kind, FollowUpKind::kAdjustment);
    ASSERT_OK(parted->status);
    const std::vector<SubmapRecord> submaps = worker.Submaps();
    ASSERT_EQ(submaps.size(), 4u) << "12 are cut in halves until none has more than 4";
    for (const SubmapRecord& submap : submaps) {
      EXPECT_EQ(submap.images.size(), 3u);
      EXPECT_EQ(submap.images_at_adjustment, 0u);
    }
    size_t adjusted = 0;
    while (const auto step = ingest.RunNextStep()) {
      ASSERT_OK(step->status);
      EXPECT_EQ(step->reconstruction, kCity);
      ++adjusted;
    }
    EXPECT_EQ(adjusted, 4u);
    ExpectSound(scene);
    for (const SubmapRecord& submap : worker.Submaps()) EXPECT_EQ(submap.images_at_adjustment, 3u);
    EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->image_count, 12u);
    for (uint32_t k = 0; k < 12; ++k) EXPECT_LT(CenterError(scene, k), 0.005);
    if (digest.empty()) digest = DigestHex(scene);
    EXPECT_EQ(DigestHex(scene), digest);
  }
}

TEST(SubmapSteps, TheSubmapsAroundAreAdjustedTogether) {
  SceneDatabase scene(kArc);
  scene.LimitTracks(2);
  AddArc(&scene);
  Worker worker(&scene);
  ASSERT_OK(worker.Part());
  ASSERT_EQ(worker.Submaps().size(), 4u);
  for (const uint32_t k : {0u, 4u}) Displace(&scene, k, 0.01);
  worker.options.schedule.region_images_max = 6;
  worker.options.schedule.whole_again_images_max = 0;
  ASSERT_OK(worker.Adjust(1));
  std::vector<ImageId> adjusted;
  for (const SubmapRecord& submap : worker.Submaps()) {
    const auto border = scene.Snap()->FindSubmapBorder(submap.id);
    ASSERT_OK(border);
    EXPECT_EQ(border->has_value(), submap.images_at_adjustment > 0) << submap.id.value;
    if (submap.images_at_adjustment > 0)
      adjusted.insert(adjusted.end(), submap.images.begin(), submap.images.end());
  }
  EXPECT_EQ(adjusted.size(), 6u) << "two of the four, and the others stay due";
  for (const uint32_t k : {0u, 4u}) {
    if (std::ranges::count(adjusted, ImageId(k + 1)) > 0) {
      EXPECT_LT(CenterError(scene, k), 0.005) << "camera " << k;
    }
  }
  EXPECT_EQ(std::ranges::count(adjusted, ImageId(1)), 1) << "submap 1 holds the first camera";
  ExpectSound(scene);
}

TEST(SubmapSteps, OneThatIsTooSmallStaysDueUntilItsOwnStepJoinsIt) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  const auto transaction = scene.database()->BeginTransaction();
  std::vector<ImageId> others;
  for (uint32_t k = 2; k <= 12; ++k) others.push_back(ImageId(k));
  transaction->PutSubmap({SubmapId(1), kCity, others, 0});
  transaction->PutSubmap({SubmapId(2), kCity, {ImageId(1)}, 0});
  ASSERT_OK(transaction->Commit());
  Worker worker(&scene);
  worker.options.schedule.submap_images_max = worker.options.schedule.region_images_max = 12;
  ASSERT_OK(worker.Adjust(1));
  ASSERT_EQ(worker.Submaps().size(), 2u);
  EXPECT_EQ(worker.Submaps()[0].images_at_adjustment, 11u);
  EXPECT_EQ(worker.Submaps()[1].images_at_adjustment, 0u);
  ASSERT_OK(worker.Adjust(2));
  ASSERT_EQ(worker.Submaps().size(), 1u) << "it has joined the other";
  ASSERT_OK(worker.Adjust(1));
  EXPECT_EQ(worker.Submaps()[0].images_at_adjustment, 12u);
  ExpectSound(scene);
}

TEST(SubmapSteps, WhatIsOutsideIsHeld) {
  SceneDatabase scene(kArc);
  scene.LimitTracks(2);  // so that not all cameras are around the submap
  AddArc(&scene);
  Worker worker(&scene);
  ASSERT_OK(worker.Part());
  const SubmapRecord first = worker.Submaps().front();
  Displace(&scene, first.images[0].value - 1, 0.01);
  const auto before = scene.Snap();
  ASSERT_OK(worker.Adjust(1));
  EXPECT_LT(CenterError(scene, first.images[0].value - 1), 0.005);
  for (uint32_t k = 0; k < 12; ++k) {
    const ImageId id(k + 1);
    const bool has_moved = (*before->FindPose(id))->cam_from_world.translation !=
                           (*scene.Snap()->FindPose(id))->cam_from_world.translation;
    EXPECT_EQ(has_moved, std::ranges::binary_search(first.images, id)) << "camera " << k;
  }
  EXPECT_EQ(worker.Adjust(99).status().code(), StatusCode::kNotFound);
}

TEST(SubmapSteps, SubmapsThatAreTooLargeOrTooSmallAreReshaped) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  Worker worker(&scene);
  worker.options.schedule.submap_images_max = 6;
  ASSERT_OK(worker.Part());
  ASSERT_EQ(worker.Submaps().size(), 2u);
  worker.options.schedule.submap_images_max = 4;
  ASSERT_OK(worker.Adjust(1));
  std::vector<SubmapRecord> submaps = worker.Submaps();
  ASSERT_EQ(submaps.size(), 3u) << "the first is parted, and not adjusted";
  for (const SubmapRecord& submap : submaps) EXPECT_EQ(submap.images_at_adjustment, 0u);
  ExpectSound(scene);
  worker.options.schedule.submap_images_max = 6;
  worker.options.schedule.submap_images_min = 4;
  ASSERT_OK(worker.Adjust(submaps.back().id.value));
  submaps = worker.Submaps();
  ASSERT_EQ(submaps.size(), 2u) << "three of six images are too few, and join the other three";
  for (const SubmapRecord& submap : submaps) {
    EXPECT_EQ(submap.images.size(), 6u);
    EXPECT_EQ(submap.images_at_adjustment, 0u);
  }
  ExpectSound(scene);
}

TEST(SubmapSteps, APartInsideThatIsContradictedIsSplitOff) {
  std::string digest;
  for (const size_t thread_count : {1, 2}) {
    SceneDatabase scene(kTwoSides, thread_count);
    ASSERT_EQ(AddTwoSides(&scene), kCity);
    ContradictSeam(&scene);
    Worker worker(&scene);
    const auto transaction = scene.database()->BeginTransaction();
    for (const uint32_t side : {0u, 1u})
      transaction->PutSubmap({SubmapId(side + 1), kCity, SideImages(side), 0});
    ASSERT_OK(transaction->Commit());
    const auto adjusted = worker.Adjust(2);
    ASSERT_OK(adjusted);
    ASSERT_EQ(adjusted->split_off.size(), 1u);
    ExpectSound(scene);
    EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->image_count, 4u);
    for (const ImageId id : SideImages(1)) {
      const auto pose = *scene.Snap()->FindPose(id);
      ASSERT_TRUE(pose.has_value());
      EXPECT_EQ(pose->reconstruction, adjusted->split_off.front());
      EXPECT_LT(CenterError(scene, id.value - 1), 0.02) << "it keeps its frame";
    }
    ASSERT_EQ(worker.Submaps().size(), 1u) << "what was split off has no submaps";
    EXPECT_EQ(worker.Submaps().front().images, SideImages(0));
    const auto hypotheses = scene.Snap()->ListHypotheses();
    ASSERT_OK(hypotheses);
    ASSERT_EQ(hypotheses->size(), 1u);
    EXPECT_EQ(hypotheses->front().a, kCity);
    EXPECT_EQ(hypotheses->front().b, adjusted->split_off.front());
    EXPECT_EQ(hypotheses->front().reason, RefusalReason::kSplit);
    EXPECT_GT(hypotheses->front().contradicting_pairs, 0u);
    EXPECT_TRUE(hypotheses->front().is_due) << "its sides are weighed";
    if (digest.empty()) digest = DigestHex(scene);
    EXPECT_EQ(DigestHex(scene), digest);
  }
}

// The image stays home to its points and sees those no more that three others see.
void ForgetOwnViews(SceneDatabase* scene, ImageId image) {
  SceneWork work(scene);
  ASSERT_OK(work.loader.LoadToUnplace(image));
  size_t forgotten = 0;
  for (const PointRecord& point : work.map.StoredBlock(image).points) {
    if (point.track.size() < 3) continue;
    work.map.RemoveObservation(point.id, image);
    ++forgotten;
  }
  ASSERT_GT(forgotten, 30u);
  Placement placement;
  placement.reconstruction = kCity;
  const auto transaction = scene->database()->BeginTransaction();
  ASSERT_OK(WritePlacementChanges(work.map, *scene->Snap(), placement, {}, transaction.get()));
  ASSERT_OK(transaction->Commit());
}

TEST(SubmapSteps, ImagesThatLoseTheirPosesLeaveTheirPointsToOthers) {
  SceneDatabase scene(kArc);
  scene.LimitTracks(3);
  AddArc(&scene);
  ForgetOwnViews(&scene, ImageId(4));
  ExpectSound(scene);
  const auto transaction = scene.database()->BeginTransaction();
  transaction->PutSubmap({SubmapId(1), kCity, {ImageId(4)}, 0});
  std::vector<ImageId> others;
  for (uint32_t k = 1; k <= 12; ++k) {
    if (k != 4) others.push_back(ImageId(k));
  }
  transaction->PutSubmap({SubmapId(2), kCity, others, 11});
  ASSERT_OK(transaction->Commit());
  Worker worker(&scene);
  worker.options.schedule.submap_images_min = 1;
  worker.options.mapper.doubt.parts.shared_points_min = 1'000'000;
  const auto adjusted = worker.Adjust(1);
  ASSERT_OK(adjusted);
  ASSERT_EQ(adjusted->unplaced.size(), 1u);
  ExpectSound(scene);
  EXPECT_EQ(scene.Snap()->GetReconstruction(kCity)->image_count, 11u);
  EXPECT_EQ(worker.Submaps().size(), 1u);
}

// Leaves the image so many of the points that it sees.
void LeavePoints(SceneDatabase* scene, ImageId image, size_t count) {
  SceneWork work(scene);
  ASSERT_OK(work.loader.LoadNeighborhood({&image, 1}));
  const std::vector<PointId> seen = work.map.PointsSeenBy({&image, 1});
  ASSERT_GT(seen.size(), count);
  for (size_t i = count; i < seen.size(); ++i) work.map.RemoveObservation(seen[i], image);
  Placement placement;
  placement.reconstruction = kCity;
  const auto transaction = scene->database()->BeginTransaction();
  ASSERT_OK(WritePlacementChanges(work.map, *scene->Snap(), placement, {}, transaction.get()));
  ASSERT_OK(transaction->Commit());
}

TEST(SubmapSteps, WhatFewPointsHoldOutsideLosesItsPoseByItsOwnSubmap) {
  SceneDatabase scene(kArc);
  AddArc(&scene);
  LeavePoints(&scene, ImageId(7), 19);
  ExpectSound(scene);
  const auto transaction = scene.database()->BeginTransaction();
  for (const uint32_t half : {0u, 1u}) {
    std::vector<ImageId> images;
    for (uint32_t k = 6 * half; k < 6 * half + 6; ++k) images.push_back(ImageId(k + 1));
    transaction->PutSubmap({SubmapId(half + 1), kCity, images, half == 0 ? 0u : 6u});
  }
  ASSERT_OK(transaction->Commit());
  Worker worker(&scene);
  worker.options.schedule.submap_images_max = 6;
  GrowthOptions& growth = worker.options.mapper.growth;
  growth.error_px_max = growth.search_radius_px = -1;  // no track grows
  const auto first = worker.Adjust(1);
  ASSERT_OK(first);
  EXPECT_TRUE(first->unplaced.empty());
  ASSERT_EQ(worker.Submaps().size(), 2u);
  EXPECT_EQ(worker.Submaps()[0].images_at_adjustment, 6u);
  EXPECT_EQ(worker.Submaps()[1].images_at_adjustment, 0u) << "it is due";
  ExpectSound(scene);
  const auto second = worker.Adjust(2);
  ASSERT_OK(second);
  ASSERT_EQ(second->unplaced.size(), 1u);
  EXPECT_EQ(second->unplaced.front().image, ImageId(7));
  ExpectSound(scene);
  EXPECT_EQ(worker.Submaps()[1].images.size(), 5u);
}

TEST(SubmapSteps, APartThatReachesOutStays) {
  SceneDatabase scene(kTwoSides);
  ASSERT_EQ(AddTwoSides(&scene), kCity);
  ContradictSeam(&scene);
  Worker worker(&scene);
  const auto transaction = scene.database()->BeginTransaction();
  // Each submap has two images of either side, so no side lies in one.
  for (const uint32_t i : {0u, 1u}) {
    std::vector<ImageId> images;
    for (const uint32_t side : {0u, 1u}) {
      images.push_back(SideImages(side)[2 * i]);
      images.push_back(SideImages(side)[2 * i + 1]);
    }
    transaction->PutSubmap({SubmapId(i + 1), kCity, images, 0});
  }
  ASSERT_OK(transaction->Commit());
  for (const uint32_t submap : {1u, 2u}) {
    const auto adjusted = worker.Adjust(submap);
    ASSERT_OK(adjusted);
    EXPECT_TRUE(adjusted->split_off.empty());
    EXPECT_TRUE(adjusted->unplaced.empty());
  }
  ExpectSound(scene);
}

}  // namespace
}  // namespace veduta
