// SPDX-License-Identifier: Apache-2.0
// Goal: where a judgment finds that a side of a refused seam shows two places, they are split; and
//   where so much was split since people last did something that it might never end, those of the
//   other place are unsure instead.
// Method: a synthetic scene of two places, stored as two reconstructions in each of which the
//   second place is laid over the first, with a hypothesis that they are one; options that find
//   something missing in whatever merge.
#include "engine/ingest/judging.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "engine/journal/journal.h"
#include "tests/engine/ingest/overlaid_scene.h"

namespace veduta {
namespace {

constexpr SceneOptions kTwoPlaces{
    .camera_count = 16, .point_count = 1215, .arc_deg = 24, .beside = 7};

constexpr ReconstructionId kFirst(1), kSecond(3);

IngestOptions Refusing() {
  IngestOptions options;
  options.mapper.doubt.missing_cells_min = 1;
  options.mapper.doubt.seam_missing_share_max = 1e-9;
  options.mapper.doubt.seam_visibility.search_radius_px = 1e-3;
  return options;
}

class JudgingMixed : public testing::Test {
 protected:
  JudgingMixed() : scene_(kTwoPlaces) {
    scene_.AddImages(0, 16);
    Sim3 over;
    over.translation.x() = -kTwoPlaces.beside;
    EXPECT_EQ(AddOverlaid(&scene_, {0, 1, 2, 3}, {8, 9, 10, 11}, over), kFirst);
    EXPECT_EQ(AddOverlaid(&scene_, {4, 5, 6, 7}, {12, 13, 14, 15}, over), kSecond);
    HypothesisRecord hypothesis;
    hypothesis.a = kFirst;
    hypothesis.b = kSecond;
    hypothesis.image = ImageId(4);
    for (uint32_t id = 1; id <= 16; ++id) hypothesis.images.push_back(ImageId(id));
    hypothesis.is_due = true;
    const auto transaction = scene_.database()->BeginTransaction();
    transaction->PutHypothesis(hypothesis);
    EXPECT_OK(transaction->Commit());
  }

  void NoteSplits(size_t count) {
    const auto transaction = scene_.database()->BeginTransaction();
    DatabaseState state = scene_.State();
    for (size_t i = 0; i < count; ++i)
      AppendJournal({0, 0, "veduta", "split", {}, ReconstructionId(1), ""}, &state,
                    transaction.get());
    transaction->PutState(state);
    ASSERT_OK(transaction->Commit());
  }

  void Judge() {
    Retrieval retrieval({});
    CityMap map;
    const IngestOptions options = Refusing();
    ASSERT_OK(
        JudgeAnew({scene_.database(), &retrieval, scene_.features(), scene_.pool(), options, &map},
                  kFirst, kSecond, BeginWrite(scene_.database())));
    const auto violations = FindViolations(*scene_.Snap(), 9);
    ASSERT_OK(violations);
    EXPECT_TRUE(violations->empty());
  }
  size_t CountReconstructions() {
    std::set<ReconstructionId> with_images;
    EXPECT_OK(scene_.Snap()->ScanPoses([&](const PoseRecord& pose) {
      with_images.insert(pose.reconstruction);
      return true;
    }));
    return with_images.size();
  }

  SceneDatabase scene_;
};

TEST_F(JudgingMixed, TheOtherPlaceIsSplitOff) {
  Judge();
  EXPECT_EQ(CountReconstructions(), 3u);
}

TEST_F(JudgingMixed, WhereSplittingMightNeverEndTheOtherPlaceIsUnsure) {
  NoteSplits(4);
  Judge();
  EXPECT_EQ(CountReconstructions(), 2u);
  const auto all = scene_.Snap()->ListHypotheses();
  ASSERT_OK(all);
  ASSERT_EQ(all->size(), 1u);
  for (const uint32_t id : {9, 10, 11, 12})
    EXPECT_TRUE(std::ranges::binary_search(all->front().unsure, ImageId(id))) << id;
}

}  // namespace
}  // namespace veduta
