// SPDX-License-Identifier: Apache-2.0
// Goal: images that few points hold together against many verified matches are told apart; pairs
//   that are noise split nothing; the order of the evidence does not matter.
// Method: two groups of images, each of which agrees, with chosen evidence between the two.
#include "engine/mapping/agreeing_parts.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "storage/base/content_hash.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

using Parts = std::vector<std::vector<ImageId>>;

std::vector<ImageId> Ids(uint32_t first, uint32_t last) {
  std::vector<ImageId> ids;
  for (uint32_t id = first; id <= last; ++id) ids.push_back(ImageId(id));
  return ids;
}

// Images 1 to 5 and images 6 to 9: within a group each pair shares points and agrees.
std::vector<PairEvidence> TwoGroups() {
  std::vector<PairEvidence> evidence;
  for (uint32_t a = 1; a <= 9; ++a) {
    for (uint32_t b = a + 1; b <= 9; ++b) {
      if ((a <= 5) == (b <= 5)) evidence.push_back({ImageId(a), ImageId(b), 100, 200, 0});
    }
  }
  return evidence;
}

TEST(AgreeingParts, FewPointsAgainstManyMatchesDoNotHoldTwoGroupsTogether) {
  std::vector<PairEvidence> evidence = TwoGroups();
  evidence.push_back({ImageId(5), ImageId(6), 25, 30, 0});
  for (const uint32_t b : {7, 8, 9}) evidence.push_back({ImageId(4), ImageId(b), 0, 0, 80});
  const Parts apart = {Ids(1, 5), Ids(6, 9)};
  EXPECT_EQ(FindAgreeingParts(Ids(1, 9), evidence, {}), apart);
  // The same points, and nothing against them.
  for (PairEvidence& e : evidence) e.contradicting_matches = 0;
  EXPECT_EQ(FindAgreeingParts(Ids(1, 9), evidence, {}), Parts{Ids(1, 9)});
  // Fewer points than can hold two parts together.
  EXPECT_EQ(FindAgreeingParts(Ids(1, 9), evidence, {.shared_points_min = 26}), apart);
}

TEST(AgreeingParts, ContradictionsAreWeighedAgainstWhatAgrees) {
  std::vector<PairEvidence> evidence = TwoGroups();
  evidence.push_back({ImageId(5), ImageId(6), 40, 100, 69});
  EXPECT_EQ(FindAgreeingParts(Ids(1, 9), evidence, {}).size(), 1u);
  evidence.back().contradicting_matches = 71;
  EXPECT_EQ(FindAgreeingParts(Ids(1, 9), evidence, {}).size(), 2u);
  EXPECT_EQ(FindAgreeingParts(Ids(1, 9), evidence, {.contradiction_share_max = 0.8}).size(), 1u);
}

TEST(AgreeingParts, NoiseSplitsNothing) {
  std::vector<PairEvidence> evidence = TwoGroups();
  for (uint32_t a = 1; a <= 5; ++a) {
    for (uint32_t b = 6; b <= 9; ++b) evidence.push_back({ImageId(a), ImageId(b), 10, 30, 0});
  }
  // One pair in each group, and one across, is a wrong one.
  for (PairEvidence& e : evidence) {
    const std::pair<uint32_t, uint32_t> ids(e.a.value, e.b.value);
    if (ids == std::pair(1u, 2u) || ids == std::pair(6u, 9u) || ids == std::pair(1u, 9u))
      std::swap(e.agreeing_matches, e.contradicting_matches);
  }
  EXPECT_EQ(FindAgreeingParts(Ids(1, 9), evidence, {}), Parts{Ids(1, 9)});
}

TEST(AgreeingParts, WhatTwoImagesDoNotBearTheirPartsMay) {
  // Images 1 and 2 contradict each other; each agrees with image 3.
  const std::vector<PairEvidence> evidence = {{ImageId(1), ImageId(2), 90, 20, 30},
                                              {ImageId(1), ImageId(3), 50, 100, 0},
                                              {ImageId(2), ImageId(3), 40, 100, 0}};
  EXPECT_EQ(FindAgreeingParts(Ids(1, 3), evidence, {}), Parts{Ids(1, 3)});
}

TEST(AgreeingParts, TheOrderOfTheEvidenceDoesNotMatter) {
  std::vector<PairEvidence> evidence = TwoGroups();
  evidence.push_back({ImageId(5), ImageId(6), 25, 30, 0});
  evidence.push_back({ImageId(4), ImageId(7), 0, 0, 80});
  for (PairEvidence& e : evidence) e.shared_points += (e.a.value * e.b.value) % 3;
  const Parts parts = FindAgreeingParts(Ids(1, 9), evidence, {});
  ASSERT_EQ(parts.size(), 2u);
  SeededRandom random(7);
  for (int round = 0; round < 20; ++round) {
    for (size_t i = evidence.size(); i > 1; --i)
      std::swap(evidence[i - 1], evidence[random.Below(static_cast<uint32_t>(i))]);
    EXPECT_EQ(FindAgreeingParts(Ids(1, 9), evidence, {}), parts);
  }
}

TEST(AgreeingParts, ImagesOfWhichNothingIsKnownStandAlone) {
  const Parts alone = {{ImageId(2)}, {ImageId(4)}};
  EXPECT_EQ(FindAgreeingParts(std::vector{ImageId(2), ImageId(4)}, {}, {}), alone);
  EXPECT_TRUE(FindAgreeingParts({}, {}, {}).empty());
}

TEST(AgreeingParts, RefusesWhatIsOutOfBounds) {
  ExpectBounds(&AgreementBounds::shared_points_min, "shared_points_min", {0u}, {1u, 100u});
  ExpectBounds(&AgreementBounds::contradiction_share_max, "contradiction_share_max", {0.0, -1.0},
               {0.01, 5.0});
}

}  // namespace
}  // namespace veduta
