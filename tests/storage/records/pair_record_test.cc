// SPDX-License-Identifier: Apache-2.0
// Goal: a pair comes back as it was stored; one that breaks a rule is not encoded, and a damaged
//   value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/pair_record.h"

#include <gtest/gtest.h>

#include <limits>

#include "storage/records/key_bytes.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(PairRecord, RoundTrips) {
  for (const size_t count : {0, 1, 1501}) {
    const PairRecord pair = SamplePair(3, kMax, count);
    PairRecord decoded;
    RoundTrip(pair, &decoded, pair.a, pair.b);
    EXPECT_EQ(decoded.a, pair.a);
    EXPECT_EQ(decoded.b, pair.b);
    EXPECT_EQ(decoded.geometry, pair.geometry);
    EXPECT_EQ(decoded.matches, pair.matches);
    EXPECT_EQ(decoded.lens_a, pair.lens_a);
    EXPECT_EQ(decoded.lens_b, pair.lens_b);
    EXPECT_EQ(decoded.b_from_a.rotation.coeffs(), pair.b_from_a.rotation.coeffs());
    EXPECT_EQ(decoded.b_from_a.translation, pair.b_from_a.translation);
  }
  PairNeighbor decoded;
  RoundTrip(PairNeighbor{ImageId(5), kMax, PairGeometry::kRotation}, &decoded, ImageId(5));
  EXPECT_EQ(decoded.image, ImageId(5));
  EXPECT_EQ(decoded.match_count, kMax);
  EXPECT_EQ(decoded.geometry, PairGeometry::kRotation);
}

TEST(PairRecord, RefusesWhatBreaksARule) {
  PairRecord pair = SamplePair(1, 2, 3);
  std::swap(pair.matches[0], pair.matches[2]);
  ExpectRefused(pair, "matches");
  pair = SamplePair(2, 2, 3);
  ExpectRefused(pair, "greater than a");
  pair = SamplePair(1, 2, 3);
  pair.geometry = static_cast<PairGeometry>(9);
  ExpectRefused(pair, "geometry");
  pair = SamplePair(1, 2, 3);
  pair.lens_b.focal_px = -1;
  ExpectRefused(pair, "focalBPx");
  pair.lens_b.focal_px = std::numeric_limits<double>::infinity();
  ExpectRefused(pair, "focalBPx");
}

TEST(PairRecord, DamagedValueIsCorruption) {
  Fuzz(SamplePair(1, 2, 5), ImageId(1), ImageId(2));
  Fuzz(PairNeighbor{ImageId(1), 4, PairGeometry::kGeneral}, ImageId(1));
}

TEST(PairRecord, NeighborsAndRecordsDoNotMix) {
  const std::string end = PrefixEnd(NeighborPrefix(ImageId(0xFFFFFFFF)));
  EXPECT_LT(NeighborKey(ImageId(0xFFFFFFFF), ImageId(0xFFFFFFFF)), end);
  EXPECT_GE(PairKey(ImageId(1), ImageId(2)), end);
}

}  // namespace
}  // namespace veduta
