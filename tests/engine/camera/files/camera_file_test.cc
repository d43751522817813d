// SPDX-License-Identifier: Apache-2.0
// Goal: a camera file is read back as it was written; files of newer versions and damaged ones are
//   refused with a message; the cameras of a cameras.txt are chosen by their id; any bytes are
//   answered by a message or by a camera that CheckCamera accepts.
// Method: a calibration of a session of known truth; its file changed in one place each; files
//   written by hand; random damage to a good file.
#include "engine/camera/files/camera_file.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/camera/projection.h"
#include "tests/engine/camera/files/sample_calibration.h"
#include "tests/engine/camera/mutated_text.h"

namespace veduta {
namespace {

using testing::SampleCalibration;

TEST(CameraFile, ReadBackAsWritten) {
  const std::string text = CameraFileText(SampleCalibration(), "points.json");
  const auto read = ParseCameraFile(text, {});
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->model, SampleCalibration().model);
  EXPECT_NE(read->source.find("calibrated from points.json: 8 photos"), std::string::npos)
      << read->source;
  EXPECT_FALSE(ParseCameraFile(text, 3).ok());
  const nlohmann::json file = nlohmann::json::parse(text);
  EXPECT_EQ(file["version"], kCameraFileVersion);
  EXPECT_EQ(file["calibration"]["photos"].size(), 8u);
  EXPECT_NEAR(file["standard_deviations"]["fx"].get<double>(), SampleCalibration().Sigma(0), 1e-12);
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

TEST(CameraFile, AnyBytesAreAnswered) {
  const std::string camera = CameraFileText(SampleCalibration(), "points.json");
  SeededRandom random(6);
  uint32_t accepted = 0, refused = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto read = ParseCameraFile(testing::MutatedText(camera, &random), {});
    ++(read.ok() ? accepted : refused);
    EXPECT_TRUE(read.ok() ? CheckCamera(read->model).ok() : !read.status().message().empty());
  }
  EXPECT_GT(accepted, 50u);
  EXPECT_GT(refused, 50u);
}

}  // namespace
}  // namespace veduta
