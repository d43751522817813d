// SPDX-License-Identifier: Apache-2.0
// Goal: a depth map's record comes back as it was stored; one that breaks a rule is not encoded,
//   and a damaged value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/depth_record.h"

#include <gtest/gtest.h>

#include "tests/storage/dense_samples.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(DepthRecord, RoundTrips) {
  DepthRecord depth = SampleDepth(1);
  RoundTrip(SampleDepth(1), &depth);
  CheckedDepthRecord checked = SampleChecked(1, 9);
  RoundTrip(SampleChecked(1, 9), &checked);
  DepthPixels pixels;
  RoundTrip(SamplePixels(), &pixels);
  EXPECT_EQ(pixels.codes, SamplePixels().codes);
  EXPECT_EQ(pixels.confidence, SamplePixels().confidence);
}

TEST(DepthRecord, RefusesWhatBreaksARule) {
  std::vector<DepthRecord> depths(8, SampleDepth(1));
  depths[0].image = ImageId();
  depths[1].width_px = 0;
  depths[2].fx = kNan;
  depths[3].depth_near = 0;
  depths[4].depth_far = depths[4].depth_near;
  depths[5].cam_from_world.translation.x() = kNan;
  depths[6].sensors[0].image = ImageId();
  depths[7].gain[1] = -1;
  for (const DepthRecord& depth : depths)
    EXPECT_EQ(Encode(depth).status().code(), StatusCode::kInvalidArgument);
  CheckedDepthRecord checked = SampleChecked(1, 1);
  std::swap(checked.blocks[0], checked.blocks[1]);
  EXPECT_EQ(Encode(checked).status().code(), StatusCode::kInvalidArgument);
  DepthPixels pixels = SamplePixels();
  pixels.confidence.pop_back();
  EXPECT_EQ(Encode(pixels).status().code(), StatusCode::kInvalidArgument);
}

TEST(DepthRecord, DamagedValueIsCorruption) {
  Fuzz(SampleDepth(1));
  Fuzz(SampleChecked(1, 1));
  Fuzz(SamplePixels());
}

TEST(DepthRecord, EveryCutIsCorruption) {
  ExpectEveryCutIsCorruption(SampleDepth(1));
}

TEST(DepthRecord, KeysReadBack) {
  ImageId image;
  uint64_t version = 0;
  ASSERT_OK(ParseDenseKey(DepthKey(ImageId(kMax)), &image));
  EXPECT_EQ(image, ImageId(kMax));
  ASSERT_OK(ParseDenseKey(CheckedDepthKey(ImageId(7), ~0ull - 1), &image, &version));
  EXPECT_EQ(image, ImageId(7));
  EXPECT_EQ(version, ~0ull - 1);
  EXPECT_FALSE(ParseDenseKey(DepthKey(ImageId(7)), &image, &version).ok());
  EXPECT_FALSE(ParseDenseKey(CheckedDepthKey({}, 1), &image, &version).ok());
}

}  // namespace
}  // namespace veduta
