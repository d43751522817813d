// SPDX-License-Identifier: Apache-2.0
// Goal: a seam that stands on one photo is believed where a loop of seams closes there, and not
//   where the loop contradicts it, says too little, or stands on the same photos.
// Method: a synthetic room of four sides, each a reconstruction in a frame of its own, whose photos
//   of the corners see two sides.
#include "engine/ingest/seam_loop.h"

#include <gtest/gtest.h>

#include "engine/ingest/forbidding.h"
#include "engine/ingest/ingest.h"
#include "engine/ingest/merging.h"
#include "engine/mapping/similarity.h"
#include "tests/engine/ingest/scene_database.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

constexpr uint32_t kSides = 4, kOfSide = 6;
constexpr ReconstructionId kFirst(1), kSecond(2), kThird(3), kFourth(4);

HypothesisRecord SeamOf(ReconstructionId a, ReconstructionId b, std::vector<ImageId> images = {},
                        RefusalReason reason = RefusalReason::kUndetermined) {
  HypothesisRecord hypothesis;
  hypothesis.a = a;
  hypothesis.b = b;
  hypothesis.reason = reason;
  hypothesis.images = std::move(images);
  return hypothesis;
}

std::vector<std::pair<uint32_t, uint32_t>> SeamsOf(std::span<const HypothesisRecord> detour) {
  std::vector<std::pair<uint32_t, uint32_t>> seams;
  for (const HypothesisRecord& one : detour) seams.emplace_back(one.a.value, one.b.value);
  return seams;
}

TEST(Detour, IsTheShortestOverOtherSeams) {
  using Seams = std::vector<std::pair<uint32_t, uint32_t>>;
  std::vector<HypothesisRecord> all = {SeamOf(kFirst, kSecond), SeamOf(kSecond, kThird),
                                       SeamOf(kThird, kFourth), SeamOf(kFirst, kFourth)};
  EXPECT_EQ(SeamsOf(Detours(all).Find(kFirst, kFourth)), (Seams{{1, 2}, {2, 3}, {3, 4}}));
  EXPECT_EQ(SeamsOf(Detours(all).Find(kFourth, kFirst)), (Seams{{3, 4}, {2, 3}, {1, 2}}));
  all.push_back(SeamOf(kFirst, kThird));
  EXPECT_EQ(SeamsOf(Detours(all).Find(kFirst, kFourth)), (Seams{{1, 3}, {3, 4}}));
  all.push_back(SeamOf(kSecond, kFourth));
  EXPECT_EQ(SeamsOf(Detours(all).Find(kFirst, kFourth)), (Seams{{1, 2}, {2, 4}})) << "lower ids";
  EXPECT_TRUE(Detours({}).Find(kFirst, kFourth).empty());
}

TEST(Detour, LeadsOverNothingThatEvidenceSpeaksAgainst) {
  for (const RefusalReason reason :
       {RefusalReason::kContradicted, RefusalReason::kMissingStructure, RefusalReason::kFewPoints,
        RefusalReason::kSplit, RefusalReason::kOpen}) {
    const HypothesisRecord all[] = {SeamOf(kFirst, kSecond), SeamOf(kSecond, kThird, {}, reason)};
    EXPECT_TRUE(Detours(all).Find(kFirst, kThird).empty()) << static_cast<int>(reason);
  }
}

TEST(Detour, IsNotLongerThanFiveSeams) {
  std::vector<HypothesisRecord> all;
  for (uint32_t i = 1; i <= 6; ++i)
    all.push_back(SeamOf(ReconstructionId(i), ReconstructionId(i + 1)));
  EXPECT_EQ(Detours(all).Find(kFirst, ReconstructionId(6)).size(), 5u);
  EXPECT_TRUE(Detours(all).Find(kFirst, ReconstructionId(7)).empty());
}

class Loop : public testing::Test {
 protected:
  Loop() : scene_({.camera_count = kSides * kOfSide, .point_count = 3200, .room = true}) {
    scene_.AddImages(0, kSides * kOfSide);
    for (uint32_t side = 0; side < kSides; ++side) {
      std::vector<uint32_t> cameras;
      for (uint32_t k = 0; k < kOfSide; ++k) cameras.push_back(side * kOfSide + k);
      frames_.push_back(Frame(side));
      scene_.AddReconstruction(cameras, frames_.back());
    }
  }
  static Sim3 Frame(uint32_t side) {
    return {
        0.5 + 0.3 * side,
        Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * side, Eigen::Vector3d(1, 2, 3).normalized())),
        {1.0 * side, 2, -1.0 * side}};
  }
  // The two photos that look at the corner from a side to the next, and the first one there.
  static std::vector<ImageId> AtCorner(uint32_t side) {
    const uint32_t next = (side + 1) % kSides;
    std::vector<ImageId> images = {ImageId(side * kOfSide + kOfSide - 1),
                                   ImageId(side * kOfSide + kOfSide), ImageId(next * kOfSide + 1)};
    std::ranges::sort(images);
    return images;
  }
  Sim3 AFromB(uint32_t a, uint32_t b) const { return frames_[a] * frames_[b].Inverse(); }
  HypothesisRecord Corner(uint32_t side) const {
    const uint32_t next = (side + 1) % kSides, a = std::min(side, next), b = std::max(side, next);
    HypothesisRecord seam =
        SeamOf(ReconstructionId(a + 1), ReconstructionId(b + 1), AtCorner(side));
    seam.a_from_b = AFromB(a, b);
    return seam;
  }
  // Only the last photo at the corner is left to lead from the fourth side to the first.
  void LeaveOneAcross() {
    const auto transaction = scene_.database()->BeginTransaction();
    for (uint32_t k = 3 * kOfSide; k < 4 * kOfSide - 1; ++k) {
      for (uint32_t j = 0; j < kOfSide; ++j)
        transaction->DeletePair(ImageId(k + 1), ImageId(j + 1));
    }
    ASSERT_OK(transaction->Commit());
  }
  // The matches of the last photo with the first side, each with the feature that comes `shift`
  // later: as of another place that looks alike.
  void Shift(size_t shift) {
    const auto transaction = scene_.database()->BeginTransaction();
    const ImageId last(4 * kOfSide);
    for (uint32_t j = 1; j <= kOfSide; ++j) {
      auto pair = scene_.Snap()->GetPair(ImageId(j), last);
      if (!pair.ok()) continue;
      std::vector<FeatureMatch> shifted;
      for (size_t i = 0; i + shift < pair->matches.size(); ++i)
        shifted.push_back({pair->matches[i].a, pair->matches[i + shift].b});
      pair->matches = std::move(shifted);
      transaction->PutPair(*pair);
    }
    ASSERT_OK(transaction->Commit());
  }

  std::optional<ClosedLoop> Close(std::span<const HypothesisRecord> detour,
                                  const LoopOptions& options = {},
                                  const std::optional<Sim3>& refuted = {}) {
    SceneWork work(&scene_);
    work.options.loop = options;
    const std::vector<ImageId> near = {ImageId(4 * kOfSide)};
    EXPECT_OK(work.loader.LoadNeighborhood(near));
    auto closed = CloseLoop(work.context, {kFourth, kFirst, near, refuted}, detour);
    EXPECT_OK(closed);
    return closed.ok() ? *closed : std::nullopt;
  }
  // From the fourth side to the first, over all corners but the last.
  std::vector<HypothesisRecord> Back() const { return {Corner(2), Corner(1), Corner(0)}; }

  SceneDatabase scene_;
  std::vector<Sim3> frames_;
};

TEST_F(Loop, ASeamThatStandsOnOnePhotoIsBelieved) {
  LeaveOneAcross();
  const auto closed = Close(Back());
  ASSERT_TRUE(closed);
  ASSERT_EQ(closed->parts.size(), 3u);
  ASSERT_EQ(closed->seams.size(), 4u);
  EXPECT_EQ(closed->seams[0].near, std::vector{ImageId(4 * kOfSide)});
  for (const LoopPart& part : closed->parts) {
    const Sim3 wanted = AFromB(3, part.id.value - 1);
    EXPECT_NEAR(part.own_from_part.scale / wanted.scale, 1, 0.01) << part.id.value;
    EXPECT_LT(part.own_from_part.rotation.angularDistance(wanted.rotation), 0.005);
    EXPECT_LT((part.own_from_part.translation - wanted.translation).norm(), 0.2);
  }
  EXPECT_EQ(closed->parts[0].id, kFirst) << "the one that was asked for";
  EXPECT_NE(closed->evidence.find("the way through reconstruction 3, 2 agrees"), std::string::npos)
      << closed->evidence;
}

TEST_F(Loop, OverARefutedSimilarityItIsThePairsAgainstItThatClose) {
  LeaveOneAcross();
  const Sim3 shift{1, Eigen::Quaterniond::Identity(), {5, 0, 0}};
  EXPECT_TRUE(Close(Back(), {}, AFromB(3, 0) * shift)) << "no pair speaks for that one";
  EXPECT_FALSE(Close(Back(), {}, AFromB(3, 0))) << "no pair is left that speaks for another one";
}

TEST(LoopSeams, ARefutedSeamMayCloseOneWhereSomethingContradictsIt) {
  for (const RefusalReason reason :
       {RefusalReason::kContradicted, RefusalReason::kMissingStructure}) {
    HypothesisRecord seam = SeamOf(kFirst, kSecond, {}, reason);
    EXPECT_FALSE(MayCloseLoop(seam));
    seam.contradicting_pairs = 1;
    EXPECT_TRUE(MayCloseLoop(seam));
    EXPECT_FALSE(MayCloseLoop(reason)) << "not over the similarity itself";
  }
  EXPECT_TRUE(MayCloseLoop(SeamOf(kFirst, kSecond)));
  EXPECT_TRUE(MayCloseLoop(SeamOf(kFirst, kSecond, {}, RefusalReason::kFarApart)));
  EXPECT_FALSE(MayCloseLoop(SeamOf(kFirst, kSecond, {}, RefusalReason::kSplit)));
}

TEST_F(Loop, WithoutADetourItIsNot) {
  LeaveOneAcross();
  EXPECT_FALSE(Close({}));
}

TEST_F(Loop, OneThatShowsAnotherPlaceIsNot) {
  LeaveOneAcross();
  Shift(1);
  EXPECT_FALSE(Close(Back()));
}

TEST_F(Loop, ADetourThatLeavesTooMuchOpenClosesNothing) {
  LeaveOneAcross();
  EXPECT_FALSE(Close(Back(), {.position_share_max = 1e-4}));
  EXPECT_FALSE(Close(Back(), {.rotation_deg_max = 1e-3}));
  EXPECT_FALSE(Close(Back(), {.log_scale_deviation_max = 1e-9}));
  EXPECT_FALSE(Close(Back(), {.distance_max = 1e-9}));
  EXPECT_FALSE(Close(Back(), {.matches_min = 100'000}));
}

TEST_F(Loop, ADetourOverTheSamePhotoIsNoSecondWitness) {
  LeaveOneAcross();
  // The photo at the last corner is at the corner before it, too.
  PairRecord pair;
  pair.a = ImageId(3 * kOfSide);
  pair.b = ImageId(4 * kOfSide);
  pair.b_from_a.translation = {1, 0, 0};
  pair.matches = {{0, 0}, {1, 1}, {2, 2}};
  const auto transaction = scene_.database()->BeginTransaction();
  transaction->PutPair(pair);
  ASSERT_OK(transaction->Commit());
  EXPECT_FALSE(Close(Back()));
}

TEST_F(Loop, IsTheSameAgain) {
  LeaveOneAcross();
  const auto closed = Close(Back()), again = Close(Back());
  ASSERT_TRUE(closed && again);
  EXPECT_EQ(closed->parts[0].own_from_part.translation, again->parts[0].own_from_part.translation);
  EXPECT_EQ(closed->evidence, again->evidence);
}

// All four are joined, though no seam is believed by itself.
TEST_F(Loop, BecomesOneReconstruction) {
  LeaveOneAcross();
  {
    const auto transaction = scene_.database()->BeginTransaction();
    for (const HypothesisRecord& seam : Back()) transaction->PutHypothesis(seam);
    HypothesisRecord last = SeamOf(kFirst, kFourth, AtCorner(3), RefusalReason::kOpen);
    last.is_due = true;
    transaction->PutHypothesis(last);
    ASSERT_OK(transaction->Commit());
  }
  IngestOptions options;
  options.schedule.views_step = 100;
  options.mapper.doubt.seam_jackknife_share_max = 1e-12;
  Retrieval retrieval({});
  Ingest ingest(scene_.database(), &retrieval, scene_.features(), scene_.pool(), options);
  const auto first = ingest.RunNextStep();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->merged_into, kFirst) << "all of it in one transaction";
  EXPECT_EQ(scene_.Snap()->GetReconstruction(kFirst)->image_count, kSides * kOfSide);
  while (auto step = ingest.RunNextStep()) ASSERT_OK(step->status);
  EXPECT_EQ(scene_.Snap()->GetReconstruction(kFirst)->image_count, kSides * kOfSide);
  EXPECT_TRUE(scene_.Snap()->ListHypotheses()->empty());
  ExpectSound(scene_);
  // One similarity carries all cameras to where they are.
  std::vector<Rigid3> found, wanted;
  for (uint32_t k = 0; k < kSides * kOfSide; ++k) {
    found.push_back((*scene_.Snap()->FindPose(ImageId(k + 1)))->cam_from_world);
    wanted.push_back(scene_.scene().poses[k]);
  }
  const auto truth_from_found = FitCameras(found, wanted);
  ASSERT_TRUE(truth_from_found);
  for (uint32_t k = 0; k < found.size(); ++k) {
    const Eigen::Vector3d center = *truth_from_found * found[k].Center();
    EXPECT_LT((center - wanted[k].Center()).norm(), 0.05) << k;
  }
}

TEST_F(Loop, IsNotMergedWherePeopleForbidTwoOfItsParts) {
  LeaveOneAcross();
  const auto closed = Close(Back());
  ASSERT_TRUE(closed);
  ASSERT_OK(Forbid({ForbiddenKind::kMerge, 2, 4, 0, "bea", ""}, BeginWrite(scene_.database())));
  SceneWork work(&scene_);
  const auto merged = MergeLoop(work.context, kFourth, *closed);
  ASSERT_OK(merged);
  EXPECT_TRUE(merged->merges.empty());
}

// Two reconstructions that meet at two corners.
TEST(LoopOfTwo, ClosesByTheSecondPlace) {
  SceneDatabase scene({.camera_count = kSides * kOfSide, .point_count = 3200, .room = true});
  scene.AddImages(0, kSides * kOfSide);
  std::vector<uint32_t> one, other;
  for (uint32_t k = 0; k < 2 * kOfSide; ++k) one.push_back(k), other.push_back(2 * kOfSide + k);
  scene.AddReconstruction(one);
  scene.AddReconstruction(other, AnotherFrame());
  SceneWork work(&scene);
  // The last photos of each, which look at the two corners.
  std::vector<ImageId> near = {ImageId(1), ImageId(2 * kOfSide - 1), ImageId(2 * kOfSide)};
  ASSERT_OK(work.loader.LoadNeighborhood(near));
  const auto closed = CloseLoop(work.context, {kFirst, kSecond, near}, {});
  ASSERT_OK(closed);
  ASSERT_TRUE(*closed);
  ASSERT_EQ((*closed)->parts.size(), 1u);
  const Sim3 found = (*closed)->parts[0].own_from_part, wanted = AnotherFrame().Inverse();
  EXPECT_NEAR(found.scale / wanted.scale, 1, 0.005);
  EXPECT_LT((found.translation - wanted.translation).norm(), 0.1);
  EXPECT_NE((*closed)->evidence.find("a second place where they meet"), std::string::npos);
  near.erase(near.begin());
  const auto of_one_corner = CloseLoop(work.context, {kFirst, kSecond, near}, {});
  ASSERT_OK(of_one_corner);
  EXPECT_FALSE(*of_one_corner);
}

TEST(LoopOptions, RefusesWhatIsOutOfBounds) {
  using O = LoopOptions;
  ExpectBounds(&O::matches_min, "matches_min", {0u}, {1u, 1000u});
  ExpectBounds(&O::other_sightings_min, "other_sightings_min", {0u}, {1u, 100u});
  ExpectBounds(&O::log_scale_deviation_max, "log_scale_deviation_max", {0.0, -1.0}, {0.001, 1.0});
  ExpectBounds(&O::bend_deg, "bend_deg", {-0.1}, {0.0, 1.0});
  ExpectBounds(&O::bend_log_scale, "bend_log_scale", {-0.1}, {0.0, 1.0});
  ExpectBounds(&O::position_share_max, "position_share_max", {0.0, 1.1}, {0.1, 1.0});
  ExpectBounds(&O::rotation_deg_max, "rotation_deg_max", {0.0, 180.0}, {0.1, 179.0});
  ExpectBounds(&O::distance_max, "distance_max", {0.0, -1.0}, {0.1, 10.0});
  ExpectBounds(&O::shared_points_min, "shared_points_min", {0u}, {1u, 100u});
}

}  // namespace
}  // namespace veduta
