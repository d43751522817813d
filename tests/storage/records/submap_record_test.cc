// SPDX-License-Identifier: Apache-2.0
// Goal: a submap comes back as it was stored, by key and value; one that breaks a rule is not
//   encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/submap_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

SubmapRecord Sample() {
  SubmapRecord record;
  record.id = SubmapId(70000);
  record.reconstruction = ReconstructionId(3);
  record.images = {ImageId(2), ImageId(9), ImageId(kMax)};
  record.images_at_adjustment = 2;
  record.motion = Sim3{2.5, Eigen::Quaterniond(0, 1, 0, 0), {1, -2, 3}};
  return record;
}

TEST(SubmapRecord, RoundTrips) {
  const SubmapRecord record = Sample();
  SubmapRecord decoded;
  ASSERT_OK(ParseSubmapKey(SubmapKey(record.id), &decoded));
  RoundTrip(record, &decoded);
  EXPECT_EQ(decoded.id, record.id);
  EXPECT_EQ(decoded.reconstruction, record.reconstruction);
  EXPECT_EQ(decoded.images, record.images);
  EXPECT_EQ(decoded.images_at_adjustment, record.images_at_adjustment);
  ASSERT_TRUE(decoded.motion.has_value());
  EXPECT_EQ(decoded.motion->scale, 2.5);
  EXPECT_EQ(decoded.motion->rotation.coeffs(), record.motion->rotation.coeffs());
  EXPECT_EQ(decoded.motion->translation, record.motion->translation);
  SubmapRecord still = Sample();
  still.motion.reset();
  RoundTrip(still, &decoded);
  EXPECT_FALSE(decoded.motion.has_value());
}

TEST(SubmapRecord, RefusesWhatBreaksARule) {
  using Break = void (*)(SubmapRecord*);
  const std::pair<Break, const char*> rules[] = {
      {[](SubmapRecord* r) { r->id = {}; }, "submap"},
      {[](SubmapRecord* r) { r->reconstruction = {}; }, "reconstruction"},
      {[](SubmapRecord* r) { r->images.clear(); }, "number of images"},
      {[](SubmapRecord* r) { r->images[0] = {}; }, "an image"},
      {[](SubmapRecord* r) { r->images[1] = r->images[0]; }, "list of images"},
      {[](SubmapRecord* r) { r->images_at_adjustment = 4; }, "images_at_adjustment"},
      {[](SubmapRecord* r) { r->motion->scale = 0; }, "scale of the motion"},
      {[](SubmapRecord* r) { r->motion->translation.x() = kNan; }, "translation"}};
  for (const auto& [break_rule, word] : rules) {
    SubmapRecord record = Sample();
    break_rule(&record);
    ExpectRefused(record, word);
  }
}

TEST(SubmapRecord, DamagedValuesAreCorruption) {
  Fuzz(Sample());
  ExpectEveryCutIsCorruption(Sample());
}

TEST(SubmapRecord, DamagedKeysAreCorruption) {
  const std::string key = SubmapKey(SubmapId(1));
  SubmapRecord record;
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseSubmapKey(key.substr(0, length), &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseSubmapKey(key + "x", &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseSubmapKey("state", &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseSubmapKey(SubmapKey({}), &record).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
