// SPDX-License-Identifier: Apache-2.0
// Goal: files of surveyed points are read as ODM writes them, in coordinates of surveyors; a line
//   that is wrong is named.
// Method: positions that are known in two kinds of coordinates; each rule broken once; texts of
//   seeded bytes.
#include "engine/earth/ground_file.h"

#include <gtest/gtest.h>

#include "engine/earth/local_frame.h"
#include "storage/base/content_hash.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(ParseGroundPoints, ReadsLinesOfOdm) {
  const auto file = ParseGroundPoints(
      "WGS84 UTM 33N\n"
      "# east north height x y photo point\n"
      "500000 5213000.5 353.2 1024.5 700 IMG_0001.jpg gcp01\r\n"
      "\n"
      "500000\t5213000.5\t353.2\t30\t40\tmy photo.jpg\tgcp01\n"
      "500010 5213000 353 12 13 IMG_0001.jpg");
  ASSERT_OK(file);
  const std::vector<GroundLine>& lines = file->lines;
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0].point, "gcp01");
  EXPECT_EQ(lines[0].photo, "IMG_0001.jpg");
  EXPECT_EQ(lines[0].x_px, 1024.5);
  EXPECT_EQ(lines[0].y_px, 700);
  EXPECT_EQ(lines[0].number, 3);
  EXPECT_EQ(lines[1].photo, "my photo.jpg");
  EXPECT_EQ(lines[2].point, "500010 5213000 353");
  // On the central meridian of zone 33.
  EXPECT_NEAR(lines[0].position.longitude_deg, 15, 1e-9);
  EXPECT_NEAR(lines[0].position.latitude_deg, 47.0703, 1e-3);
  EXPECT_EQ(lines[0].position.height_m, 353.2);
  const Eigen::Vector3d between = LocalFrame(lines[0].position).FromGeo(lines[2].position);
  // UTM's scale on that meridian is 0.9996.
  EXPECT_NEAR(between.x(), 10 / 0.9996, 2e-3);
  EXPECT_NEAR(between.y(), -0.5 / 0.9996, 2e-3);
}

// "geo_x geo_y geo_z im_x im_y image_name [gcp_name] [extra1] [extra2]", as ODM's page has it.
TEST(ParseGroundPoints, WhatFollowsTheNameIsIgnored) {
  const auto words = ParseGroundPoints(
      "EPSG:4326\n"
      "15 47 350 1 2 a.jpg gcp01 5 x\n"
      "15 47 350 1 2 b.jpg gcp01 6\n"
      "15 47 350 1 2 c.jpg\tgcp01\n");
  EXPECT_EQ(words.status().code(), StatusCode::kInvalidArgument) << "a line with one tabulator";
  const auto file = ParseGroundPoints(
      "EPSG:4326\n"
      "15 47 350 1 2 a.jpg gcp01 5 x\n"
      "15 47 350 1 2 b.jpg  gcp01 6\n"
      "15\t47\t350\t1\t2\tc.jpg\tcorner of the town hall\t5\tmore\n"
      "15\t47\t350\t1\t2\td.jpg\tcorner of the town hall \r\n");
  ASSERT_OK(file);
  ASSERT_EQ(file->lines.size(), 4u);
  EXPECT_EQ(file->lines[0].point, "gcp01");
  EXPECT_EQ(file->lines[1].point, "gcp01");
  EXPECT_EQ(file->lines[2].point, "corner of the town hall");
  EXPECT_EQ(file->lines[3].point, "corner of the town hall");
}

TEST(ParseGroundPoints, KnowsTheCoordinatesByTheirCode) {
  for (const char* named : {"EPSG:32633",
                            "\xEF\xBB\xBF"
                            "EPSG:32633",
                            "+proj=utm +zone=33 +datum=WGS84 +units=m +no_defs"}) {
    const auto lines =
        ParseGroundPoints(std::string(named) + "\n500000 5213000.5 353.2 1 2 a.jpg p\n");
    ASSERT_OK(lines);
    EXPECT_NEAR(lines->lines.front().position.longitude_deg, 15, 1e-9) << named;
  }
  // Degrees: longitude first, whatever the order of the code is.
  const auto degrees = ParseGroundPoints("EPSG:4326\n15.44 47.07 350 1 2 a.jpg p\n");
  ASSERT_OK(degrees);
  EXPECT_NEAR(degrees->lines.front().position.latitude_deg, 47.07, 1e-9);
  EXPECT_NEAR(degrees->lines.front().position.longitude_deg, 15.44, 1e-9);
  // South of the equator.
  const auto south = ParseGroundPoints("WGS84 UTM 56S\n334000 6251000 20 1 2 a.jpg p\n");
  ASSERT_OK(south);
  EXPECT_NEAR(south->lines.front().position.latitude_deg, -33.86, 0.02);
}

TEST(ParseGroundPoints, KnowsUtmByZoneAndSide) {
  for (const char* named : {"WGS84 UTM 33N", "WGS84 UTM 33n"}) {
    const auto lines = ParseGroundPoints(std::string(named) + "\n533400 5213040 350 1 2 a.jpg\n");
    ASSERT_OK(lines);
    EXPECT_NEAR(lines->lines.front().position.longitude_deg, 15.44, 0.01);
    EXPECT_NEAR(lines->lines.front().position.latitude_deg, 47.07, 0.01);
  }
  const auto south = ParseGroundPoints("WGS84 UTM 33s\n533400 5213040 350 1 2 a.jpg\n");
  ASSERT_OK(south);
  EXPECT_LT(south->lines.front().position.latitude_deg, -40);
}

TEST(ParseGroundPoints, HeightsAboveAGeoidAreBroughtToTheEllipsoid) {
  const auto lines = ParseGroundPoints("EPSG:32633+5773\n533400 5213040 350 1 2 a.jpg\n");
  ASSERT_OK(lines);
  EXPECT_NEAR(lines->lines.front().position.height_m, 397.5, 0.2) << "EGM96 comes with PROJ";
}

// PROJ converts the plan's axes alone.
TEST(ParseGroundPoints, HeightsAreInTheUnitOfThePlan) {
  constexpr double kSurveyFootM = 1200.0 / 3937;
  const auto height_m = [](const std::string& named, const std::string& place) {
    const auto file = ParseGroundPoints(named + "\n" + place + " 1 2 a.jpg\n");
    EXPECT_OK(file);
    return file.ok() ? file->lines.front().position.height_m : 0;
  };
  for (const char* named : {"EPSG:2263", "EPSG:6539"})
    EXPECT_NEAR(height_m(named, "1000000 200000 100"), 100 * kSurveyFootM, 1e-6) << named;
  const std::string utm = "+proj=utm +zone=33 +datum=WGS84 +no_defs ";
  EXPECT_NEAR(height_m(utm + "+units=us-ft", "1730000 17213000 100"), 100 * kSurveyFootM, 1e-6);
  EXPECT_NEAR(height_m(utm + "+units=us-ft +towgs84=0,0,0", "1730000 17213000 100"),
              100 * kSurveyFootM, 1e-6);
  // A height that has a unit of its own is in that one.
  EXPECT_NEAR(height_m(utm + "+units=m +vunits=us-ft", "530000 5213000 100"), 100 * kSurveyFootM,
              1e-6);
  EXPECT_NEAR(height_m("EPSG:4326", "15 47 100"), 100, 1e-9);
}

TEST(ParseGroundPoints, TellsHowExactlyTheDatumIsKnown) {
  const auto coordinates = [](const std::string& text) {
    const auto file = ParseGroundPoints(text);
    EXPECT_OK(file);
    return file.ok() ? file->coordinates : GroundCoordinates();
  };
  const GroundCoordinates britain = coordinates("EPSG:27700\n400000 300000 50 1 2 a.jpg\n");
  EXPECT_EQ(britain.name, "EPSG:27700");
  EXPECT_TRUE(britain.operation.starts_with("OSGB36 to WGS 84 (")) << britain.operation;
  EXPECT_GE(britain.accuracy_m.value(), 1) << "a grid would be better, and is not here";
  EXPECT_EQ(coordinates("EPSG:25833\n530000 5213000 350 1 2 a.jpg\n").accuracy_m, 1);
  for (const char* named : {"EPSG:32633", "WGS84 UTM 33N", "EPSG:4326"}) {
    const bool has_degrees = std::string_view(named) == "EPSG:4326";
    const GroundCoordinates same = coordinates(
        std::string(named) + (has_degrees ? "\n15 47" : "\n530000 5213000") + " 350 1 2 a.jpg\n");
    EXPECT_EQ(same.accuracy_m, 0) << named;
    EXPECT_EQ(same.name, named);
  }
  EXPECT_FALSE(coordinates("+proj=utm +zone=33 +ellps=GRS80 +towgs84=1,2,3\n"
                           "530000 5213000 350 1 2 a.jpg\n")
                   .accuracy_m);
  // Where the lines need several operations, the least exact one is told: in this one Alaska and
  // Canada have ways of their own.
  const std::string east = "-75 41 0 1 2 a.jpg\n", north = "-150 65 0 1 2 b.jpg\n";
  const auto of_east = coordinates("EPSG:4267\n" + east),
             of_north = coordinates("EPSG:4267\n" + north),
             of_both = coordinates("EPSG:4267\n" + north + east),
             the_other_way = coordinates("EPSG:4267\n" + east + north);
  EXPECT_EQ(of_both.accuracy_m, std::max(of_east.accuracy_m.value(), of_north.accuracy_m.value()));
  EXPECT_EQ(the_other_way.accuracy_m, of_both.accuracy_m);
  EXPECT_EQ(the_other_way.operation, of_both.operation);
}

void ExpectRefused(const std::string& text, const std::string& why) {
  const Status refused = ParseGroundPoints(text).status();
  EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument) << text;
  EXPECT_NE(refused.message().find(why), std::string::npos) << refused.message();
}

TEST(ParseGroundPoints, NamesWhatIsWrong) {
  ExpectRefused("", "is empty");
  ExpectRefused("# nothing\n\n", "is empty");
  ExpectRefused("the moon\n1 2 3 4 5 a.jpg\n", "line 1: 'the moon' names no coordinates");
  for (const char* utm : {"WGS84 UTM 33", "WGS84 UTM 61N", "WGS84 UTM 0S", "WGS84 UTM N"})
    ExpectRefused(std::string(utm) + "\n1 2 3 4 5 a.jpg\n", "names no coordinates");
  // EGM2008, whose grid does not come with PROJ.
  ExpectRefused("EPSG:32633+3855\n533400 5213040 350 1 2 a.jpg\n", "needs a grid");
  ExpectRefused("EPSG:4326\n15 47 350 1 2\n", "line 2: has 5 fields");
  ExpectRefused("EPSG:4326\n\n15 47 high 1 2 a.jpg\n", "line 3: 'high' is no number");
  ExpectRefused("EPSG:4326\n15 47 nan 1 2 a.jpg\n", "has no height ('nan')");
  ExpectRefused("EPSG:4326\n15 47 NaN 1 2 a.jpg\n", "line 2: the point has no height ('NaN')");
  ExpectRefused("EPSG:4326\nnan 47 0 1 2 a.jpg\n", "'nan' is no number");
  ExpectRefused("+proj=utm +zone=33 +ellps=GRS80 +units=m +no_defs\n1 2 3 4 5 a.jpg\n",
                "has no datum");
  ExpectRefused("EPSG:4326\n15 97 0 1 2 a.jpg\n", "nowhere on the earth");
  ExpectRefused("EPSG:32633\n1e300 5 0 1 2 a.jpg\n", "nowhere on the earth");
  ExpectRefused("EPSG:4326\n15 47 0 1 2 a.jpg p\n15 47 1 1 2 b.jpg p\n",
                "line 3: point 'p' was elsewhere");
}

TEST(ParseGroundPoints, EndsOnAnyText) {
  SeededRandom random(3);
  constexpr std::string_view kBytes = "EPSG:4326 \n\t+-.e015#\0\xff=proj";
  for (int i = 0; i < 300; ++i) {
    std::string text = random.Below(2) == 0 ? "EPSG:4326\n" : "";
    for (uint32_t length = random.Below(80); length > 0; --length)
      text += kBytes[random.Below(kBytes.size())];
    const auto lines = ParseGroundPoints(text);
    if (!lines.ok()) {
      EXPECT_EQ(lines.status().code(), StatusCode::kInvalidArgument);
    }
  }
}

}  // namespace
}  // namespace veduta
