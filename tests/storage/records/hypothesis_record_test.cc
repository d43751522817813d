// SPDX-License-Identifier: Apache-2.0
// Goal: a hypothesis comes back as it was stored, by key and value; one that breaks a rule is not
//   encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/hypothesis_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

HypothesisRecord Sample() {
  HypothesisRecord record;
  record.a = ReconstructionId(3);
  record.b = ReconstructionId(70000);
  record.reason = RefusalReason::kMissingStructure;
  SeededRandom random(1);
  const Rigid3 rigid = SampleRigid(&random);
  record.a_from_b = {0.25, rigid.rotation, rigid.translation};
  record.common_point_count = 31;
  record.agreeing_pairs = 4;
  record.contradicting_pairs = 5;
  record.agreeing_matches = 600;
  record.contradicting_matches = 7;
  record.judged_cells = 80;
  record.missing_cells = 79;
  record.image = ImageId(9);
  record.images = {ImageId(2), ImageId(9), ImageId(kMax)};
  record.unsure = {ImageId(2), ImageId(kMax)};
  record.judgment_count = 11;
  record.is_due = true;
  record.loop_images = 13;
  record.time_unix_s = -5;
  return record;
}

TEST(HypothesisRecord, RoundTrips) {
  const HypothesisRecord record = Sample();
  HypothesisRecord decoded;
  ASSERT_OK(ParseHypothesisKey(HypothesisKey(record.a, record.b), &decoded));
  RoundTrip(record, &decoded);
  EXPECT_EQ(decoded.a, record.a);
  EXPECT_EQ(decoded.b, record.b);
  EXPECT_EQ(decoded.kind, record.kind);
  EXPECT_EQ(decoded.reason, record.reason);
  EXPECT_EQ(decoded.a_from_b.scale, record.a_from_b.scale);
  EXPECT_EQ(decoded.a_from_b.rotation.coeffs(), record.a_from_b.rotation.coeffs());
  EXPECT_EQ(decoded.a_from_b.translation, record.a_from_b.translation);
  EXPECT_EQ(decoded.common_point_count, record.common_point_count);
  EXPECT_EQ(decoded.agreeing_pairs, record.agreeing_pairs);
  EXPECT_EQ(decoded.contradicting_pairs, record.contradicting_pairs);
  EXPECT_EQ(decoded.agreeing_matches, record.agreeing_matches);
  EXPECT_EQ(decoded.contradicting_matches, record.contradicting_matches);
  EXPECT_EQ(decoded.judged_cells, record.judged_cells);
  EXPECT_EQ(decoded.missing_cells, record.missing_cells);
  EXPECT_EQ(decoded.image, record.image);
  EXPECT_EQ(decoded.images, record.images);
  EXPECT_EQ(decoded.unsure, record.unsure);
  EXPECT_EQ(decoded.judgment_count, record.judgment_count);
  EXPECT_TRUE(decoded.is_due);
  EXPECT_EQ(decoded.loop_images, record.loop_images);
  EXPECT_EQ(decoded.time_unix_s, record.time_unix_s);
}

TEST(HypothesisRecord, RefusesWhatBreaksARule) {
  using Break = void (*)(HypothesisRecord*);
  const std::pair<Break, const char*> rules[] = {
      {[](HypothesisRecord* r) { r->a = {}; }, "first reconstruction"},
      {[](HypothesisRecord* r) { r->b = r->a; }, "second reconstruction"},
      {[](HypothesisRecord* r) { r->kind = static_cast<HypothesisKind>(2); }, "kind"},
      {[](HypothesisRecord* r) { r->reason = static_cast<RefusalReason>(0); }, "reason"},
      {[](HypothesisRecord* r) { r->reason = static_cast<RefusalReason>(9); }, "reason"},
      {[](HypothesisRecord* r) { r->a_from_b.scale = 0; }, "scale"},
      {[](HypothesisRecord* r) { r->a_from_b.scale = kNan; }, "scale"},
      {[](HypothesisRecord* r) { r->a_from_b.translation.x() = kNan; }, "translation"},
      {[](HypothesisRecord* r) { r->missing_cells = r->judged_cells + 1; }, "missing_cells"},
      {[](HypothesisRecord* r) { r->judgment_count = 0; }, "judgment_count"},
      {[](HypothesisRecord* r) { r->images.clear(); }, "number of images"},
      {[](HypothesisRecord* r) { r->images[0] = {}; }, "an image"},
      {[](HypothesisRecord* r) { r->images[1] = r->images[0]; }, "list of images"},
      {[](HypothesisRecord* r) { r->unsure[1] = r->unsure[0]; }, "list of unsure images"},
      {[](HypothesisRecord* r) { r->unsure[1] = ImageId(10); }, "list of unsure images"}};
  for (const auto& [break_rule, word] : rules) {
    HypothesisRecord record = Sample();
    break_rule(&record);
    ExpectRefused(record, word);
  }
}

TEST(HypothesisRecord, DamagedValuesAreCorruption) {
  Fuzz(Sample());
  ExpectEveryCutIsCorruption(Sample());
}

TEST(HypothesisRecord, DamagedKeysAreCorruption) {
  const std::string key = HypothesisKey(ReconstructionId(1), ReconstructionId(2));
  HypothesisRecord record;
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseHypothesisKey(key.substr(0, length), &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseHypothesisKey(key + "x", &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseHypothesisKey("state", &record).code(), StatusCode::kCorruption);
  EXPECT_EQ(
      ParseHypothesisKey(HypothesisKey(ReconstructionId(2), ReconstructionId(1)), &record).code(),
      StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
