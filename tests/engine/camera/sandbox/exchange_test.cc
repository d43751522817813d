// SPDX-License-Identifier: Apache-2.0
// Goal: what an honest decoder finds arrives as it is, and no answer of a decoder that was taken
//   over becomes more than a photo could say.
// Method: answers there and back; each field of a sound answer set to what it cannot be; seeded
//   random bytes.
#include "engine/camera/sandbox/exchange.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

PhotoExamination Found() {
  PhotoExamination found;
  found.header.outcome = HeaderOutcome::kRead;
  found.header.format = PhotoFormat::kJpeg;
  found.header.stored_size = {1536, 1024};
  found.header.orientation = 6;
  found.header.sensor_orientation = 8;
  found.header.has_restarts = true;
  found.camera = {"Make", "Model", std::string(64, 'l'), 4.2, 1};
  found.gps = GpsFix{-47.5, 179.25, -3.5, 12, 359.5};
  found.taken = TakenTime{1'700'000'000, -3600};
  return found;
}

void ExpectSame(const PhotoExamination& read, const PhotoExamination& sent) {
  EXPECT_EQ(read.header.outcome, sent.header.outcome);
  EXPECT_EQ(read.header.detail, sent.header.detail);
  EXPECT_EQ(read.header.format, sent.header.format);
  EXPECT_EQ(read.header.stored_size, sent.header.stored_size);
  EXPECT_EQ(read.header.orientation, sent.header.orientation);
  EXPECT_EQ(read.header.sensor_orientation, sent.header.sensor_orientation);
  EXPECT_EQ(read.header.has_restarts, sent.header.has_restarts);
  EXPECT_EQ(read.camera, sent.camera);
  EXPECT_EQ(read.gps, sent.gps);
  EXPECT_EQ(read.taken, sent.taken);
}

TEST(Exchange, WhatIsFoundArrives) {
  PhotoExamination found = Found();
  ASSERT_TRUE(ReadExamination(AnswerOf(found)));
  ExpectSame(*ReadExamination(AnswerOf(found)), found);
  found.gps->height_m.reset();
  found.gps->heading_deg.reset();
  ExpectSame(*ReadExamination(AnswerOf(found)), found);
  found.gps.reset();
  found.taken->offset_s.reset();
  ExpectSame(*ReadExamination(AnswerOf(found)), found);
  found.taken.reset();
  found.camera = {};
  found.header = {};
  found.header.detail = "the JPEG ends within its header";
  ExpectSame(*ReadExamination(AnswerOf(found)), found);
  for (const auto outcome : {PixelOutcome::kDecoded, PixelOutcome::kUnsupportedFormat,
                             PixelOutcome::kUnreadable, PixelOutcome::kNoMemory}) {
    const auto read = ReadPixelOutcome(AnswerOf(Pixels{outcome, "why", {}}));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->outcome, outcome);
    EXPECT_EQ(read->detail, "why");
  }
}

TEST(Exchange, TextsAreCutAndPrintable) {
  EXPECT_EQ(FromExchange(ToExchange<4>("abcdef")), "abcd");
  EXPECT_EQ(FromExchange(ToExchange<9>("a\x1b[31m\xc3\n")), "a?[31m??");
  ExchangedText<4> text;
  text.size = 5;
  EXPECT_FALSE(FromExchange(text));
  text = ToExchange<4>("abcd");
  for (const char c : {'\0', '\n', '\x1b', '\x7f', '\xff'}) {
    text.bytes[2] = c;
    EXPECT_FALSE(FromExchange(text)) << static_cast<int>(c);
  }
}

TEST(Exchange, AnswersThatCannotBeAreNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  using Damage = std::function<void(DecoderAnswer*)>;
  const std::vector<Damage> damages = {
      [](DecoderAnswer* a) { a->outcome = 4; },
      [](DecoderAnswer* a) { a->outcome = ~0u; },
      [](DecoderAnswer* a) { a->format = 0; },
      [](DecoderAnswer* a) { a->format = 6; },
      [](DecoderAnswer* a) { a->width_px = 0; },
      [](DecoderAnswer* a) { a->height_px = 0; },
      [](DecoderAnswer* a) { a->orientation = 0; },
      [](DecoderAnswer* a) { a->orientation = 9; },
      [](DecoderAnswer* a) { a->sensor_orientation = 0; },
      [](DecoderAnswer* a) { a->sensor_orientation = 9; },
      [](DecoderAnswer* a) { a->has_restarts = 2; },
      [](DecoderAnswer* a) { a->detail = ToExchange<512>("read, and yet it has a reason"); },
      [](DecoderAnswer* a) { a->detail.size = 513; },
      [](DecoderAnswer* a) { a->make.size = ~0u; },
      [](DecoderAnswer* a) { a->model.bytes[0] = '\n'; },
      [](DecoderAnswer* a) { a->lens.bytes[63] = '\x80'; },
      [](DecoderAnswer* a) { a->focal_mm = kNan; },
      [](DecoderAnswer* a) { a->focal_mm = -1; },
      [](DecoderAnswer* a) { a->digital_zoom = kInf; },
      [](DecoderAnswer* a) { a->has_gps = 2; },
      [](DecoderAnswer* a) { a->has_height = 2; },
      [](DecoderAnswer* a) { a->has_heading = 2; },
      [](DecoderAnswer* a) { a->heading_deg = 360; },
      [](DecoderAnswer* a) { a->heading_deg = -1; },
      [](DecoderAnswer* a) { a->heading_deg = kNan; },
      [](DecoderAnswer* a) { a->latitude_deg = 90.5; },
      [](DecoderAnswer* a) { a->latitude_deg = kNan; },
      [](DecoderAnswer* a) { a->longitude_deg = -181; },
      [](DecoderAnswer* a) { a->longitude_deg = kNan; },
      [](DecoderAnswer* a) { a->height_m = kInf; },
      [](DecoderAnswer* a) { a->height_m = kNan; },
      [](DecoderAnswer* a) { a->accuracy_m = -1; },
      [](DecoderAnswer* a) { a->accuracy_m = kNan; },
      [](DecoderAnswer* a) { a->has_taken = 2; },
      [](DecoderAnswer* a) { a->has_taken_offset = 2; },
      [](DecoderAnswer* a) { a->taken_local_unix_s = kTakenUnixSMax + 1; },
      [](DecoderAnswer* a) { a->taken_offset_s = kTakenOffsetSMin - 1; },
  };
  for (size_t i = 0; i < damages.size(); ++i) {
    DecoderAnswer answer = AnswerOf(Found());
    damages[i](&answer);
    EXPECT_FALSE(ReadExamination(answer)) << i;
  }
  DecoderAnswer answer = AnswerOf(Pixels{PixelOutcome::kDecoded, {}, {}});
  answer.outcome = 4;
  EXPECT_FALSE(ReadPixelOutcome(answer));
}

// A sound answer with some bytes changed, as often as not, is still one that a photo could give.
TEST(Exchange, RandomAnswersSayNothingThatPhotosCannot) {
  SeededRandom random(1);
  int taken = 0;
  for (int i = 0; i < 20'000; ++i) {
    DecoderAnswer answer = AnswerOf(Found());
    std::vector<uint8_t> bytes(sizeof(answer));
    std::memcpy(bytes.data(), &answer, sizeof(answer));
    for (uint32_t k = random.Below(4); k-- > 0;)
      bytes[random.Below(static_cast<uint32_t>(bytes.size()))] =
          static_cast<uint8_t>(random.Below(256));
    std::memcpy(&answer, bytes.data(), sizeof(answer));
    const auto found = ReadExamination(answer);
    if (!found) continue;
    ++taken;
    EXPECT_LE(found->header.detail.size(), 512u);
    EXPECT_GE(found->header.orientation, 1);
    EXPECT_LE(found->header.orientation, 8);
    EXPECT_TRUE(std::isfinite(found->camera.focal_mm) && std::isfinite(found->camera.digital_zoom));
    if (!found->gps) continue;
    EXPECT_LE(std::abs(found->gps->latitude_deg), 90);
    EXPECT_LE(std::abs(found->gps->longitude_deg), 180);
    EXPECT_TRUE(std::isfinite(found->gps->height_m.value_or(0)));
  }
  EXPECT_GT(taken, 2000);
  EXPECT_LT(taken, 19'000);
}

}  // namespace
}  // namespace veduta
