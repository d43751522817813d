// SPDX-License-Identifier: Apache-2.0
// Goal: points.json is read as docs/calibration.md describes it, or refused with a message that
//   names the place; its limits hold; any bytes are answered.
// Method: files written by hand, each with one fault; files just over each limit; random damage to
//   a good file.
#include "engine/camera/files/points_file.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/engine/camera/mutated_text.h"

namespace veduta {
namespace {

constexpr const char* kPoints = R"({"width": 640, "height": 480, "views": [
  {"name": "a.jpg", "points": [{"id": 3, "x": 1.5, "y": -2, "sigma": 0.1},
                               {"id": 4, "x": 7, "y": 8}]},
  {"name": "b.jpg", "width": 480, "height": 640, "points": [], "more": {"ignored": [1]}}]})";

TEST(PointsFile, AsDescribed) {
  const auto input = ParsePoints(kPoints);
  ASSERT_TRUE(input.ok()) << input.status().message();
  ASSERT_EQ(input->views.size(), 2u);
  EXPECT_EQ(input->views[0].name, "a.jpg");
  EXPECT_EQ(input->views[0].size, (ImageSize{640, 480}));
  EXPECT_EQ(input->views[1].size, (ImageSize{480, 640}));
  ASSERT_EQ(input->views[0].points.size(), 2u);
  EXPECT_EQ(input->views[0].points[0].id, 3u);
  EXPECT_EQ(input->views[0].points[0].px, Eigen::Vector2d(1.5, -2));
  EXPECT_EQ(input->views[0].points[0].sigma_px, 0.1);
  EXPECT_EQ(input->views[0].points[1].sigma_px, 1);
}

TEST(PointsFile, MessagesNameThePlace) {
  const std::string size = R"({"width": 640, "height": 480, "views": )";
  for (const auto& [text, words] : {
           std::pair(std::string(""), "not JSON"),
           {std::string("[1, 2"), "not JSON"},
           {std::string("[1, 2]"), "not an object"},
           {std::string("{}"), "no \"width\""},
           {std::string(R"({"width": 0, "height": 480})"),
            "\"width\" is not a whole number from 1"},
           {std::string(R"({"width": 640.5, "height": 480})"), "\"width\" is not"},
           {std::string(R"({"width": 640, "height": -480})"), "\"height\" is not"},
           {size + "3}", "\"views\" is not a list"},
           {size + "[4]}", "view 1 is not an object"},
           {size + R"([{"points": []}]})", "view 1 has no \"name\""},
           {size + R"([{"name": 7, "points": []}]})", "is no name"},
           {size + R"([{"name": "p"}]})", "view 1 'p' has no \"points\""},
           {size + R"([{"name": "p", "points": [{"id": 1, "x": 2}]}]})",
            "view 1 'p', point 1 has no \"y\""},
           {size + R"([{"name": "p", "points": [{"id": -1, "x": 2, "y": 3}]}]})",
            "\"id\" is not a whole number"},
           {size + R"([{"name": "p", "points": [{"id": 1, "x": "2", "y": 3}]}]})",
            "\"x\" is not a number"},
           {size + R"([{"name": "p", "points": [{"id": 1, "x": 1e300, "y": 3}]}]})",
            "\"x\" is not a number"},
           {size + R"([{"name": "p", "points": [{"id": 1, "x": 1, "y": 3, "sigma": 0}]}]})",
            "\"sigma\" is not"},
           {size + R"([{"name": "p", "points": []}, {"name": "p", "points": []}]})",
            "two views are named 'p'"},
           {std::string(100'000, '['), "nested too deep"},
       }) {
    const auto input = ParsePoints(text);
    ASSERT_FALSE(input.ok()) << text.substr(0, 100);
    EXPECT_NE(input.status().message().find(words), std::string::npos) << input.status().message();
  }
}

TEST(PointsFile, Limits) {
  nlohmann::json file = {{"width", 640}, {"height", 480}, {"views", nlohmann::json::array()}};
  for (size_t i = 0; i <= kViewsMax; ++i) {
    file["views"].push_back({{"name", std::to_string(i)}, {"points", nlohmann::json::array()}});
  }
  EXPECT_NE(ParsePoints(file.dump()).status().message().find("301 views"), std::string::npos);
  file["views"].erase(file["views"].begin() + 1, file["views"].end());
  for (size_t i = 0; i <= kDistinctPointsMax; ++i) {
    file["views"][0]["points"].push_back({{"id", i}, {"x", 1}, {"y", 2}});
  }
  EXPECT_NE(ParsePoints(file.dump()).status().message().find("3000 different points"),
            std::string::npos);
}

TEST(PointsFile, AnyBytesAreAnswered) {
  SeededRandom random(5);
  uint32_t accepted = 0, refused = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto points = ParsePoints(testing::MutatedText(kPoints, &random));
    ++(points.ok() ? accepted : refused);
    EXPECT_TRUE(points.ok() || !points.status().message().empty());
  }
  EXPECT_GT(accepted, 50u);
  EXPECT_GT(refused, 50u);
}

}  // namespace
}  // namespace veduta
