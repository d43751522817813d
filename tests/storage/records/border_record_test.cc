// SPDX-License-Identifier: Apache-2.0
// Goal: the border of a submap comes back as it was stored, by key and value; one that breaks a
//   rule is not encoded, and a damaged key or value is kCorruption.
// Method: round trips at every alignment; one rule broken at a time; values flipped, cut, extended
//   and replaced at seeded places.
#include "storage/records/border_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

SubmapBorder Sample() {
  SubmapBorder border;
  border.id = SubmapId(70000);
  border.views = {{0, ImageId(2), 1.5f, 2}, {0, ImageId(9), -3, 4}, {1, ImageId(1), 5, 6.25f}};
  border.evidence = {{ImageId(2), ImageId(9), 40, 3, 2, 1}, {ImageId(2), ImageId(10), 0, 0, 7, 0}};
  border.fragments = {{ImageId(2), ImageId(2)}, {ImageId(3), ImageId(2)}};
  return border;
}

TEST(BorderRecord, RoundTrips) {
  const SubmapBorder border = Sample();
  SubmapBorder decoded;
  ASSERT_OK(ParseBorderKey(BorderKey(border.id), &decoded));
  RoundTrip(border, &decoded);
  EXPECT_EQ(decoded.id, border.id);
  ASSERT_EQ(decoded.views.size(), 3u);
  EXPECT_EQ(decoded.views[2].tie, 1u);
  EXPECT_EQ(decoded.views[2].image, ImageId(1));
  EXPECT_EQ(decoded.views[1].x_px, -3);
  EXPECT_EQ(decoded.views[2].y_px, 6.25f);
  ASSERT_EQ(decoded.evidence.size(), 2u);
  EXPECT_EQ(decoded.evidence[0].shared_points, 40u);
  EXPECT_EQ(decoded.evidence[0].agreeing_matches, 3u);
  EXPECT_EQ(decoded.evidence[0].turned_matches, 1u);
  EXPECT_EQ(decoded.evidence[1].b, ImageId(10));
  EXPECT_EQ(decoded.evidence[1].contradicting_matches, 7u);
  ASSERT_EQ(decoded.fragments.size(), 2u);
  EXPECT_EQ(decoded.fragments[1].image, ImageId(3));
  EXPECT_EQ(decoded.fragments[1].head, ImageId(2));
}

TEST(BorderRecord, RefusesWhatBreaksARule) {
  using Break = void (*)(SubmapBorder*);
  const std::pair<Break, const char*> rules[] = {
      {[](SubmapBorder* b) { b->id = {}; }, "submap"},
      {[](SubmapBorder* b) { b->views[0].image = {}; }, "image of a view"},
      {[](SubmapBorder* b) { b->views[0].x_px = static_cast<float>(kNan); }, "x_px"},
      {[](SubmapBorder* b) { b->views[1].image = ImageId(2); }, "list of views"},
      {[](SubmapBorder* b) { b->views[2].tie = 2; }, "list of views"},
      {[](SubmapBorder* b) { b->views.erase(b->views.begin(), b->views.begin() + 2); },
       "list of views"},
      {[](SubmapBorder* b) { b->evidence[0].a = {}; }, "first image of evidence"},
      {[](SubmapBorder* b) { b->evidence[0].b = {}; }, "second image of evidence"},
      {[](SubmapBorder* b) { b->evidence[0].b = b->evidence[0].a; }, "second image of evidence"},
      {[](SubmapBorder* b) { b->evidence[1].b = b->evidence[0].b; }, "list of evidence"},
      {[](SubmapBorder* b) { b->fragments[0].head = {}; }, "head of a fragment"},
      {[](SubmapBorder* b) { b->fragments[0].head = ImageId(3); }, "head of a fragment"},
      {[](SubmapBorder* b) { b->fragments[1].image = ImageId(2); }, "list of fragments"}};
  for (const auto& [break_rule, word] : rules) {
    SubmapBorder border = Sample();
    break_rule(&border);
    ExpectRefused(border, word);
  }
}

TEST(BorderRecord, DamagedValuesAreCorruption) {
  Fuzz(Sample());
  ExpectEveryCutIsCorruption(Sample());
}

TEST(BorderRecord, DamagedKeysAreCorruption) {
  const std::string key = BorderKey(SubmapId(1));
  SubmapBorder border;
  for (size_t length = 0; length < key.size(); ++length)
    EXPECT_EQ(ParseBorderKey(key.substr(0, length), &border).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseBorderKey(key + "x", &border).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseBorderKey("state", &border).code(), StatusCode::kCorruption);
  EXPECT_EQ(ParseBorderKey(BorderKey({}), &border).code(), StatusCode::kCorruption);
}

}  // namespace
}  // namespace veduta
