// SPDX-License-Identifier: Apache-2.0
// Goal: a reconstruction comes back as it was stored; one that breaks a rule is not encoded, and a
//   damaged value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/reconstruction_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(ReconstructionRecord, RoundTrips) {
  const ReconstructionRecord record = SampleReconstruction(8, kMax);
  ReconstructionRecord decoded;
  RoundTrip(record, &decoded, record.id);
  EXPECT_EQ(decoded.id, record.id);
  EXPECT_EQ(decoded.merged_into, record.merged_into);
  EXPECT_EQ(decoded.merged_from_this.scale, record.merged_from_this.scale);
  EXPECT_EQ(decoded.merged_from_this.rotation.coeffs(), record.merged_from_this.rotation.coeffs());
  EXPECT_EQ(decoded.merged_from_this.translation, record.merged_from_this.translation);
  EXPECT_EQ(decoded.image_count, record.image_count);
  EXPECT_EQ(decoded.point_count, record.point_count);
  EXPECT_EQ(decoded.observation_count, record.observation_count);
  EXPECT_EQ(decoded.reprojection_error_px_sum, record.reprojection_error_px_sum);
  EXPECT_EQ(decoded.geometry_version, record.geometry_version);
  EXPECT_EQ(decoded.points_generation, record.points_generation);
  EXPECT_EQ(decoded.images_at_adjustment, record.images_at_adjustment);
  EXPECT_FALSE(decoded.is_dissolved);
}

TEST(ReconstructionRecord, OneThatIsDissolvedRoundTrips) {
  ReconstructionRecord record, decoded;
  record.id = ReconstructionId(8);
  EXPECT_TRUE(record.is_living());
  record.is_dissolved = true;
  ASSERT_OK(Decode(*Encode(record), record.id, &decoded));
  EXPECT_TRUE(decoded.is_dissolved);
  EXPECT_FALSE(decoded.is_living());
  EXPECT_FALSE(decoded.merged_into.valid());
}

TEST(ReconstructionRecord, RefusesWhatBreaksARule) {
  ReconstructionRecord reconstruction = SampleReconstruction(1, 1);
  reconstruction.merged_from_this.scale = 0;
  ExpectRefused(reconstruction, "scale");
}

TEST(ReconstructionRecord, DamagedValueIsCorruption) {
  Fuzz(SampleReconstruction(1, 2), ReconstructionId(1));
}

}  // namespace
}  // namespace veduta
