// SPDX-License-Identifier: Apache-2.0
// Goal: boxes and geometries have what is in them and on their borders, and broken ones are
//   refused.
// Method: known positions in and beside each kind.
#include "cli/service/stac_geometry.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

bool Has(const Result<EarthPart>& part, double longitude, double latitude) {
  EXPECT_OK(part);
  return part.ok() && (*part)({latitude, longitude, 0});
}

Result<EarthPart> Box(const char* json) {
  return BoxOf(Json::parse(json));
}
Result<EarthPart> Geometry(const std::string& type, const std::string& coordinates) {
  return GeometryOf(Json::parse(R"({"type":")" + type + R"(","coordinates":)" + coordinates + "}"));
}

TEST(StacGeometry, Boxes) {
  const auto box = Box("[10, 40, 12, 50]");
  EXPECT_TRUE(Has(box, 11, 45));
  EXPECT_TRUE(Has(box, 10, 50));
  EXPECT_FALSE(Has(box, 9.99, 45));
  EXPECT_FALSE(Has(box, 11, 50.01));
  EXPECT_TRUE(Has(Box("[10, 40, 0, 12, 50, 100]"), 11, 45));
  const auto across = Box("[170, -10, -170, 10]");
  EXPECT_TRUE(Has(across, 175, 0));
  EXPECT_TRUE(Has(across, -180, 0));
  EXPECT_FALSE(Has(across, 0, 0));
  for (const char* wrong : {"[1, 2, 3]", "[1, 2, 3, 4, 5]", "[0, 10, 1, 9]", "[0, 0, 181, 1]",
                            "[0, -91, 1, 1]", "\"0,0,1,1\"", "[0, 0, 1, \"1\"]", "null", "{}"})
    EXPECT_EQ(Box(wrong).status().code(), StatusCode::kInvalidArgument) << wrong;
}

TEST(StacGeometry, Polygons) {
  const auto ring =
      Geometry("Polygon", "[[[0,0],[4,0],[4,4],[0,4],[0,0]],[[1,1],[3,1],[3,3],[1,3],[1,1]]]");
  EXPECT_TRUE(Has(ring, 0.5, 0.5));
  EXPECT_FALSE(Has(ring, 2, 2));  // in its hole
  EXPECT_TRUE(Has(ring, 1, 2));   // on the border of that
  EXPECT_TRUE(Has(ring, 4, 4));
  EXPECT_FALSE(Has(ring, 5, 2));
  EXPECT_FALSE(Has(ring, -1, 4));
  const auto two =
      Geometry("MultiPolygon", "[[[[0,0],[1,0],[1,1],[0,0]]],[[[5,5],[6,5],[6,6],[5,5]]]]");
  EXPECT_TRUE(Has(two, 5.8, 5.5));
  EXPECT_FALSE(Has(two, 3, 3));
}

TEST(StacGeometry, PointsLinesAndCollections) {
  EXPECT_TRUE(Has(Geometry("Point", "[1,2]"), 1, 2));
  EXPECT_FALSE(Has(Geometry("Point", "[1,2,7]"), 1, 2.1));
  EXPECT_TRUE(Has(Geometry("MultiPoint", "[[0,0],[1,2]]"), 1, 2));
  const auto line = Geometry("LineString", "[[0,0],[2,2],[4,2]]");
  EXPECT_TRUE(Has(line, 1, 1));
  EXPECT_TRUE(Has(line, 3, 2));
  EXPECT_FALSE(Has(line, 3, 3));
  EXPECT_TRUE(Has(Geometry("MultiLineString", "[[[0,0],[1,0]],[[5,5],[6,6]]]"), 5.5, 5.5));
  const auto both = GeometryOf(Json::parse(
      R"({"type":"GeometryCollection","geometries":[{"type":"Point","coordinates":[1,2]},)"
      R"({"type":"GeometryCollection","geometries":[{"type":"Point","coordinates":[3,4]}]}]})"));
  EXPECT_TRUE(Has(both, 3, 4));
  EXPECT_FALSE(Has(both, 1, 4));
}

TEST(StacGeometry, BrokenOnesAreRefused) {
  for (const char* wrong :
       {"null", "[]", "{}", R"({"type":7})", R"({"type":"Point"})",
        R"({"type":"Circle","coordinates":[0,0]})", R"({"type":"Point","coordinates":[0]})",
        R"({"type":"Point","coordinates":[0,"0"]})", R"({"type":"Point","coordinates":[200,0]})",
        R"({"type":"LineString","coordinates":[[0,0]]})", R"({"type":"Polygon","coordinates":[]})",
        R"({"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,1]]]})",
        R"({"type":"GeometryCollection"})"})
    EXPECT_EQ(GeometryOf(Json::parse(wrong)).status().code(), StatusCode::kInvalidArgument)
        << wrong;
  std::string deep = R"({"type":"Point","coordinates":[0,0]})";
  for (int i = 0; i < 6; ++i) deep = R"({"type":"GeometryCollection","geometries":[)" + deep + "]}";
  EXPECT_EQ(GeometryOf(Json::parse(deep)).status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
