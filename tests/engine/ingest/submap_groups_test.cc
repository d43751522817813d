// SPDX-License-Identifier: Apache-2.0
// Goal: a group holds a submap and those around it, the ones that most matches lead to first, then
//   those around these, as long as there is room; those that are to be moved and the others do not
//   mix, and neither do reconstructions; motions spread to submaps beside those that have one.
// Method: a row of cameras in submaps, with pairs that are written by hand.
#include "engine/ingest/submap_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

constexpr ReconstructionId kCity(1), kOther(2);

// Submaps 1 to 4 of two images each, and submap 5 of another reconstruction. Submap 1 has 20
// matches with 3, 10 with 2 and 30 with 5; submap 4 has some with 3 only.
class SubmapGroups : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::Open(folder_ / "db", {.create = true, .sync_wal = false});
    ASSERT_OK(opened);
    database_ = *std::move(opened);
    const auto transaction = database_->BeginTransaction();
    for (uint32_t id = 1; id <= 5; ++id)
      transaction->PutSubmap({SubmapId(id), id == 5 ? kOther : kCity, Images(id), 2});
    PutPair(1, 2, 50, transaction.get());  // inside
    PutPair(1, 5, 15, transaction.get());
    PutPair(2, 6, 5, transaction.get());
    PutPair(2, 3, 10, transaction.get());
    PutPair(1, 9, 30, transaction.get());
    PutPair(5, 8, 7, transaction.get());
    ASSERT_OK(transaction->Commit());
  }

  static void PutPair(uint32_t a, uint32_t b, uint32_t matches, Transaction* transaction) {
    PairRecord pair;
    pair.a = ImageId(a);
    pair.b = ImageId(b);
    pair.b_from_a.translation = Eigen::Vector3d(1, 0, 0);
    for (uint32_t i = 0; i < matches; ++i) pair.matches.push_back({i, i});
    transaction->PutPair(pair);
  }

  static std::vector<ImageId> Images(uint32_t submap) {
    return {ImageId(2 * submap - 1), ImageId(2 * submap)};
  }

  void WantMoved(uint32_t submap) {
    const auto transaction = database_->BeginTransaction();
    transaction->PutSubmap({SubmapId(submap), kCity, Images(submap), 2, Sim3()});
    ASSERT_OK(transaction->Commit());
  }

  std::vector<uint32_t> Group(uint32_t submap, bool is_moving, size_t images_max) const {
    const auto snapshot = database_->GetSnapshot();
    const Submaps submaps = *Submaps::Read(*snapshot);
    const auto group =
        FindGroup(*snapshot, submaps, *submaps.Find(SubmapId(submap)), is_moving, images_max);
    EXPECT_OK(group);
    std::vector<uint32_t> ids;
    std::vector<ImageId> images;
    for (const SubmapId id : group->submaps) {
      ids.push_back(id.value);
      for (const ImageId image : Images(id.value)) images.push_back(image);
    }
    std::ranges::sort(images);
    EXPECT_EQ(group->images, images);
    return ids;
  }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
};

TEST_F(SubmapGroups, MatchesAreCountedByTheSubmapThatTheyLeadTo) {
  const auto snapshot = database_->GetSnapshot();
  const Submaps submaps = *Submaps::Read(*snapshot);
  const auto edges = ListEdges(*snapshot, Images(1));
  ASSERT_OK(edges);
  EXPECT_EQ(edges->size(), 6u) << "the pair inside is listed from both ends";
  const auto weights = WeighBeside(*snapshot, submaps, *submaps.Find(SubmapId(1)));
  ASSERT_OK(weights);
  EXPECT_EQ(*weights, (std::map<SubmapId, uint64_t>{{SubmapId(2), 10}, {SubmapId(3), 20}}))
      << "submap 5 is of another reconstruction";
}

TEST_F(SubmapGroups, ThoseBesideComeFirstThenThoseBesideThem) {
  EXPECT_EQ(Group(1, false, 2), std::vector<uint32_t>({1}));
  EXPECT_EQ(Group(1, false, 3), std::vector<uint32_t>({1})) << "no room for another of two";
  EXPECT_EQ(Group(1, false, 4), std::vector<uint32_t>({1, 3}));
  EXPECT_EQ(Group(1, false, 6), std::vector<uint32_t>({1, 3, 2}));
  EXPECT_EQ(Group(1, false, 8), std::vector<uint32_t>({1, 3, 2, 4}));
  EXPECT_EQ(Group(4, false, 100), std::vector<uint32_t>({4, 3, 1, 2}));
  EXPECT_EQ(Group(5, false, 100), std::vector<uint32_t>({5}));
}

TEST_F(SubmapGroups, ThoseThatAreToBeMovedAreAGroupOfTheirOwn) {
  WantMoved(3);
  EXPECT_EQ(Group(1, false, 100), std::vector<uint32_t>({1, 2}));
  WantMoved(4);
  EXPECT_EQ(Group(4, true, 100), std::vector<uint32_t>({4, 3}));
}

// 4 has matches with 3 alone, and 5 is of another reconstruction.
TEST_F(SubmapGroups, MotionsSpreadFromOneToTheNext) {
  const auto snapshot = database_->GetSnapshot();
  const Submaps submaps = *Submaps::Read(*snapshot);
  Sim3 of_one, of_two;
  of_one.translation.x() = 1, of_two.translation.x() = 2;
  std::map<SubmapId, Sim3> motions = {{SubmapId(1), of_one}, {SubmapId(2), of_two}};
  ASSERT_OK(SpreadMotions(*snapshot, submaps, kCity, &motions));
  ASSERT_EQ(motions.size(), 4u);
  EXPECT_EQ(motions.at(SubmapId(1)).translation.x(), 1);
  EXPECT_EQ(motions.at(SubmapId(2)).translation.x(), 2);
  EXPECT_EQ(motions.at(SubmapId(3)).translation.x(), 1) << "it has more matches with 1";
  EXPECT_EQ(motions.at(SubmapId(4)).translation.x(), 1);
  motions.clear();
  ASSERT_OK(SpreadMotions(*snapshot, submaps, kCity, &motions));
  EXPECT_TRUE(motions.empty());
}

}  // namespace
}  // namespace veduta
