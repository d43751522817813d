// SPDX-License-Identifier: Apache-2.0
// Goal: cameras and sizes as people type them are read exactly, and every mistake is refused
//   with its field named.
// Method: good texts with their values, tables of bad texts with what the message must contain,
//   and random models written and read back.
#include "engine/camera/camera_text.h"

#include <gtest/gtest.h>

#include <string>

#include "engine/camera/number_text.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr ImageSize kSize{1536, 1024};

TEST(ParseSize, ReadsWidthAndHeight) {
  const auto size = ParseSize("1536x1024");
  ASSERT_TRUE(size.ok()) << size.status().message();
  EXPECT_EQ(*size, kSize);
  EXPECT_EQ(ParseSize("1x65535").value(), (ImageSize{1, 65535}));
}

TEST(ParseSize, RefusesEverythingElse) {
  for (const char* text : {"",
                           "x",
                           "10",
                           "10x",
                           "x10",
                           "10X20",
                           "10 x 20",
                           " 10x20",
                           "10x20 ",
                           "-10x20",
                           "+10x20",
                           "10x20x3",
                           "0x20",
                           "10x0",
                           "65536x1",
                           "1x65536",
                           "99999999999999999999x1",
                           "1e3x10",
                           "10.0x20",
                           "0x10x20"}) {
    const auto size = ParseSize(text);
    ASSERT_FALSE(size.ok()) << text;
    EXPECT_EQ(size.status().code(), StatusCode::kInvalidArgument);
    EXPECT_NE(size.status().message().find(std::string("'") + text), std::string::npos)
        << size.status().message();
  }
}

TEST(ParseCameraParams, ReadsFourSixAndEightNumbers) {
  const CameraModel pinhole = ParseCameraParams("1379.74,1382.08,760.095,503.155", kSize).value();
  EXPECT_EQ(pinhole.width_px, 1536u);
  EXPECT_EQ(pinhole.height_px, 1024u);
  EXPECT_EQ(pinhole.fx, 1379.74);
  EXPECT_EQ(pinhole.fy, 1382.08);
  EXPECT_EQ(pinhole.cx, 760.095);
  EXPECT_EQ(pinhole.cy, 503.155);
  EXPECT_EQ(pinhole.k1, 0.0);
  EXPECT_EQ(pinhole.u0, pinhole.cx);
  EXPECT_EQ(pinhole.v0, pinhole.cy);
  const CameraModel radial = ParseCameraParams("1400,1400,768,512,-0.1,2e-2", kSize).value();
  EXPECT_EQ(radial.k1, -0.1);
  EXPECT_EQ(radial.k2, 0.02);
  EXPECT_EQ(radial.u0, 768.0);
  const CameraModel own_center =
      ParseCameraParams("1400,1400,768,512,-0.1,0.02,770.5,-3", kSize).value();
  EXPECT_EQ(own_center.u0, 770.5);
  EXPECT_EQ(own_center.v0, -3.0);
}

TEST(ParseCameraParams, NamesWhatIsWrong) {
  const struct {
    const char *text, *expected;
  } cases[] = {
      {"", "4, 6 or 8"},
      {"1,2,3", "4, 6 or 8"},
      {"1400,1400,768,512,0.1", "4, 6 or 8"},
      {"1400,1400,768,512,0.1,0,768", "4, 6 or 8"},
      {"1400,1400,768,512,0,0,768,512,9", "4, 6 or 8"},
      {",,,,,,,,,,,,,,,,,,,", "4, 6 or 8"},
      {"abc,1400,768,512", "fx = 'abc'"},
      {"1400,,768,512", "fy = ''"},
      {"1400,1400, 768,512", "cx = ' 768'"},
      {"1400,1400,768,512px", "cy = '512px'"},
      {"1400,1400,768,512,+0.1,0", "k1 = '+0.1'"},
      {"1400,1400,768,512,0,0x1p3", "k2 = '0x1p3'"},
      {"1400,1400,768,512,0,nan", "k2 = 'nan'"},
      {"inf,1400,768,512", "fx = 'inf'"},
      {"1400,1e999,768,512", "fy = '1e999' is out of the range"},
      {"0,1400,768,512", "fx = 0"},
      {"1400,-1400,768,512", "fy = -1400"},
      {"1400,1400,9999,512", "cx = 9999"},
      {"1400,1400,768,512,-2,0", "k1 = -2"},
      {"1400,1400,768,512,0,0,768,1e6", "v0 = 1e+06"},
  };
  for (const auto& c : cases) {
    const auto model = ParseCameraParams(c.text, kSize);
    ASSERT_FALSE(model.ok()) << c.text;
    EXPECT_EQ(model.status().code(), StatusCode::kInvalidArgument);
    EXPECT_NE(model.status().message().find(c.expected), std::string::npos)
        << c.text << ": " << model.status().message();
  }
  EXPECT_FALSE(ParseCameraParams("1400,1400,768,512", {}).ok()) << "no size";
  const auto long_text = ParseCameraParams(std::string(1'000'000, '7'), kSize);
  EXPECT_LT(long_text.status().message().size(), 300u) << "what was typed is quoted in part only";
}

TEST(CameraParamsText, ReadsBackAsTheSameModel) {
  SeededRandom random(11);
  for (int i = 0; i < 1000; ++i) {
    CameraModel model;
    model.width_px = kSize.width_px;
    model.height_px = kSize.height_px;
    model.fx = 1000 + 1000 * random.Unit();
    model.fy = model.fx * (0.98 + 0.04 * random.Unit());
    model.cx = 768 + 50 * (random.Unit() - 0.5);
    model.cy = 512 + 50 * (random.Unit() - 0.5);
    model.k1 = i % 3 == 0 ? 0.0 : 0.2 * (random.Unit() - 0.5);
    model.k2 = i % 3 == 0 ? 0.0 : 0.1 * random.Unit();
    model.u0 = i % 2 == 0 ? model.cx : model.cx + 10 * random.Unit();
    model.v0 = model.cy;
    const std::string text = CameraParamsText(model);
    const auto read = ParseCameraParams(text, kSize);
    ASSERT_TRUE(read.ok()) << text << ": " << read.status().message();
    EXPECT_EQ(*read, model) << text;
  }
}

TEST(NumberText, IsTheShortestThatReadsBackAsTheSame) {
  EXPECT_EQ(NumberText(0.1), "0.1");
  EXPECT_EQ(NumberText(-1536), "-1536");
  EXPECT_EQ(NumberText(1.0 / 3), "0.3333333333333333");
}

}  // namespace
}  // namespace veduta
