// SPDX-License-Identifier: Apache-2.0
// Goal: of each image the earlier ones that share most points with it are found, in one order.
// Method: few points by hand; a point that very many images see.
#include "engine/colmap/seen_together.h"

#include <gtest/gtest.h>

#include <numeric>

namespace veduta {
namespace {

using Places = std::vector<uint32_t>;

TEST(SeenTogetherTest, EarlierImagesCountByTheirPoints) {
  SeenTogether seen;
  for (const Places& point : {Places{0, 3}, Places{3, 1}, Places{1, 3, 2}, Places{2}, Places{}})
    seen.AddPoint(point);
  const std::vector<Places> all = seen.EarlierPartners(5, 24);
  EXPECT_EQ(all, (std::vector<Places>{{}, {}, {1}, {1, 0, 2}, {}}));
  EXPECT_EQ(seen.EarlierPartners(5, 2)[3], (Places{1, 0}));
}

TEST(SeenTogetherTest, APointOfVeryManyImagesCostsLittle) {
  Places many(100'000);
  std::iota(many.begin(), many.end(), 0);
  SeenTogether seen;
  seen.AddPoint(many);
  const std::vector<Places> all = seen.EarlierPartners(many.size(), 24);
  EXPECT_EQ(all[31].size(), 24u);
  EXPECT_TRUE(all[32].empty());
}

}  // namespace
}  // namespace veduta
