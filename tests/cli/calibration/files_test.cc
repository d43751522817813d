// SPDX-License-Identifier: Apache-2.0
// Goal: points.json is read as described or refused with a message that names the place; a
//   camera file is read back as it was written; any bytes are answered; the report holds what
//   it promises and nothing that a name smuggles in.
// Method: files written by hand, a calibration of a session of known truth, mutations of good
//   files.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/calibration/calibration_figures.h"
#include "cli/calibration/calibration_report.h"
#include "cli/calibration/camera_file.h"
#include "cli/calibration/points_file.h"
#include "engine/camera/projection.h"
#include "storage/base/content_hash.h"
#include "tools/bench/calibration/synthetic_session.h"

namespace veduta {
namespace {

constexpr const char* kPoints = R"({"width": 640, "height": 480, "views": [
  {"name": "a.jpg", "points": [{"id": 3, "x": 1.5, "y": -2, "sigma": 0.1}, {"id": 4, "x": 7, "y": 8}]},
  {"name": "b.jpg", "width": 480, "height": 640, "points": [], "more": {"ignored": [1]}}]})";

const Calibration& Sample() {
  static const Calibration made = [] {
    SyntheticSession session = MakeSession({.photo_count = 8, .seed = 21});
    session.input.views[2].name = "<script>\"&.jpg";
    return *CalibrateCamera(session.input);
  }();
  return made;
}

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
  EXPECT_FALSE(ReadWholeFile("no such file", 10).ok());
  EXPECT_FALSE(ReadWholeFile("/", 10).ok());
}

TEST(CameraFile, ReadBackAsWritten) {
  const std::string text = CameraFileText(Sample(), "points.json");
  const auto read = ParseCameraFile(text, {});
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->model, Sample().model);
  EXPECT_NE(read->source.find("calibrated from points.json: 8 photos"), std::string::npos)
      << read->source;
  EXPECT_FALSE(ParseCameraFile(text, 3).ok());
  const nlohmann::json file = nlohmann::json::parse(text);
  EXPECT_EQ(file["version"], kCameraFileVersion);
  EXPECT_EQ(file["calibration"]["photos"].size(), 8u);
  EXPECT_NEAR(file["standard_deviations"]["fx"].get<double>(), Sample().Sigma(0), 1e-12);
  nlohmann::json newer = file;
  newer["version"] = 2;
  EXPECT_NE(ParseCameraFile(newer.dump(), {}).status().message().find("newer"), std::string::npos);
  newer = file;
  newer["intrinsics"].erase("k2");
  EXPECT_NE(ParseCameraFile(newer.dump(), {}).status().message().find("k2"), std::string::npos);
  newer = file;
  newer["intrinsics"]["fx"] = -5;
  EXPECT_NE(ParseCameraFile(newer.dump(), {}).status().message().find("fx"), std::string::npos);
}

TEST(CameraFile, ColmapsIdChooses) {
  const std::string one = "1 PINHOLE 640 480 500 510 320.5 240.5\n";
  const std::string two = "# Camera list\n" + one + "5 SIMPLE_RADIAL 640 480 500 320 240 -0.1\n";
  EXPECT_EQ(ParseCameraFile(one, {})->model.fy, 510);
  EXPECT_NE(ParseCameraFile(two, {}).status().message().find("--id: 1, 5"), std::string::npos);
  EXPECT_EQ(ParseCameraFile(two, 5)->model.k1, -0.1);
  EXPECT_NE(ParseCameraFile(two, 4).status().message().find("no camera 4"), std::string::npos);
  const auto tangential =
      ParseCameraFile("1 OPENCV 640 480 500 510 320 240 -0.2 0.05 0.003 -0.0005", {});
  ASSERT_TRUE(tangential.ok()) << tangential.status().message();
  ASSERT_EQ(tangential->messages.size(), 2u);
  EXPECT_NE(tangential->messages[0].find("px at most"), std::string::npos);
  EXPECT_NE(tangential->messages[1].find("warning"), std::string::npos);
}

std::string Mutated(const std::string& text, SeededRandom* random) {
  std::string changed = text;
  for (uint32_t i = 0, count = 1 + random->Below(4); i < count && !changed.empty(); ++i) {
    const size_t at = random->Below(static_cast<uint32_t>(changed.size()));
    switch (random->Below(4)) {
      case 0:
        changed[at] = static_cast<char>(random->Below(256));
        break;
      case 1:
        changed.erase(at, 1 + random->Below(20));
        break;
      case 2:
        changed.insert(at, changed.substr(at, 1 + random->Below(30)));
        break;
      default:
        if (random->Below(4) == 0) changed.resize(at);
    }
  }
  return changed;
}

TEST(Files, AnyBytesAreAnswered) {
  const std::string camera = CameraFileText(Sample(), "points.json");
  SeededRandom random(5);
  uint32_t accepted = 0, refused = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto points = ParsePoints(Mutated(kPoints, &random));
    const auto read = ParseCameraFile(Mutated(camera, &random), {});
    accepted += points.ok() + read.ok();
    refused += !points.ok() + !read.ok();
    EXPECT_TRUE(!read.ok() || CheckCamera(read->model).ok());
    EXPECT_TRUE(points.ok() || !points.status().message().empty());
  }
  EXPECT_GT(accepted, 100u);
  EXPECT_GT(refused, 100u);
}

TEST(Report, HoldsWhatItPromises) {
  const std::string report = CalibrationReport(Sample(), "my <points>.json");
  for (const char* words :
       {"Coverage", "Residuals", "Distortion", "Photos", "standard deviation", "<td>k2</td>",
        "my &lt;points&gt;.json", "&lt;script&gt;&quot;&amp;.jpg"}) {
    EXPECT_NE(report.find(words), std::string::npos) << words;
  }
  EXPECT_EQ(report.find("<script"), std::string::npos);
  EXPECT_EQ(report.find("http"), report.find("http://www.w3.org/2000/svg"));  // nothing is fetched
  EXPECT_EQ(report.find("nan"), std::string::npos);
  size_t figures = 0;
  for (size_t at = report.find("<svg"); at != std::string::npos; at = report.find("<svg", at + 1))
    ++figures;
  EXPECT_EQ(figures, 4u);
  Calibration warned = Sample();
  warned.status = CalibrationStatus::kUncertain;
  warned.warnings = {{CalibrationAdvice::kFocalLength, "tilt the camera more"}};
  EXPECT_NE(CalibrationReport(warned, "p").find("tilt the camera more"), std::string::npos);
  EXPECT_EQ(CalibrationReport(warned, "p").find("no further photos"), std::string::npos);
}

TEST(Report, CoverageShowsEmptyCells) {
  Calibration half = Sample();
  std::erase_if(half.residuals, [](const CalibrationResidual& r) { return r.px.x() > 1136; });
  const auto count = [](const std::string& text) {
    size_t found = 0;
    for (size_t at = text.find("#fde8e4"); at != std::string::npos;
         at = text.find("#fde8e4", at + 1))
      ++found;
    return found;
  };
  EXPECT_GE(count(CoverageFigure(half)), 24u);
  EXPECT_LT(count(CoverageFigure(Sample())), 24u);
}

}  // namespace
}  // namespace veduta
