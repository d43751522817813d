// SPDX-License-Identifier: Apache-2.0
// Goal: a photo's features comes back as it was stored; one that breaks a rule is not encoded, and
//   a damaged value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/photo_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(PhotoRecord, RoundTrips) {
  for (const size_t count : {0, 1, 2, 5000}) {
    const Features features = SampleFeatures(count, count);
    Features decoded;
    RoundTrip(features, &decoded);
    EXPECT_EQ(decoded.keypoints, features.keypoints);
    EXPECT_EQ(decoded.descriptors, features.descriptors);
  }
}

TEST(PhotoRecord, RefusesWhatBreaksARule) {
  Features features = SampleFeatures(1, 4);
  features.descriptors.pop_back();
  ExpectRefused(features, "descriptors");
  features = SampleFeatures(1, 4);
  features.keypoints[3].angle_deg = static_cast<float>(kNan);
  ExpectRefused(features, "keypoint");
}

TEST(PhotoRecord, DamagedValueIsCorruption) {
  Fuzz(SampleFeatures(1, 3));
}

TEST(PhotoRecord, KeyReadsBack) {
  ContentHash hash;
  for (size_t i = 0; i < hash.bytes.size(); ++i) hash.bytes[i] = static_cast<uint8_t>(251 * i);
  ContentHash read;
  ASSERT_TRUE(ParseHashKey(HashKey(hash), &read));
  EXPECT_EQ(read, hash);
  EXPECT_FALSE(ParseHashKey(HashKey(hash) + "x", &read));
  EXPECT_FALSE(ParseHashKey("", &read));
}

}  // namespace
}  // namespace veduta
