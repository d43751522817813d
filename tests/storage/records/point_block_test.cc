// SPDX-License-Identifier: Apache-2.0
// Goal: a block of points comes back as it was stored; one that breaks a rule is not encoded, and a
//   damaged value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/point_block.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(PointBlock, RoundTrips) {
  for (const size_t count : {0, 1, 1200}) {
    const PointBlock block = SampleBlock(6, count);
    PointBlock decoded;
    RoundTrip(block, &decoded, block.home);
    EXPECT_EQ(decoded.home, block.home);
    EXPECT_EQ(decoded.next_ordinal, block.next_ordinal);
    ASSERT_EQ(decoded.points.size(), count);
    for (size_t i = 0; i < count; ++i) {
      EXPECT_EQ(decoded.points[i].id, block.points[i].id);
      EXPECT_EQ(decoded.points[i].position, block.points[i].position);
      EXPECT_EQ(decoded.points[i].rgb, block.points[i].rgb);
      EXPECT_EQ(decoded.points[i].error_px, block.points[i].error_px);
      EXPECT_EQ(decoded.points[i].track, block.points[i].track);
    }
  }
}

TEST(PointBlock, RefusesWhatBreaksARule) {
  PointBlock block = SampleBlock(1, 3);
  block.points[1].track.resize(1);
  ExpectRefused(block, "track length");
  block = SampleBlock(1, 3);
  block.next_ordinal = 5;
  ExpectRefused(block, "next_ordinal");
  block = SampleBlock(1, 3);
  std::swap(block.points[0], block.points[1]);
  ExpectRefused(block, "ascending");
  block = SampleBlock(1, 3);
  block.points[2].position.z() = std::numeric_limits<double>::infinity();
  ExpectRefused(block, "position");
}

TEST(PointBlock, DamagedValueIsCorruption) {
  Fuzz(SampleBlock(3, 4), ImageId(3));
}

TEST(PointBlock, EveryCutIsCorruption) {
  ExpectEveryCutIsCorruption(SampleBlock(3, 4), ImageId(3));
}

TEST(PointBlock, KeysSortByHome) {
  for (const uint32_t a : {1u, 255u, 256u, kMax}) {
    for (const uint32_t b : {1u, 255u, 256u, kMax}) {
      EXPECT_EQ(PointBlockKey(ReconstructionId(1), 5, ImageId(a)) <
                    PointBlockKey(ReconstructionId(1), 5, ImageId(b)),
                a < b);
    }
  }
  EXPECT_TRUE(PointBlockKey(ReconstructionId(2), 3, ImageId(7))
                  .starts_with(PointBlockPrefix(ReconstructionId(2), 3)));
}

}  // namespace
}  // namespace veduta
