// SPDX-License-Identifier: Apache-2.0
// Goal: transforms.json has every field that nerfstudio's page on data conventions names, its
//   cameras see the points where the photos' features are, and its photos are there, undistorted.
// Method: a street is exported; its points are projected by the matrices of the file alone, with
//   the camera looking along its negative z; with a distorted camera the photos change.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "fusion/export/exporter.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

using Json = nlohmann::json;

std::string FileText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Width and height in the header of a PNG file.
std::pair<uint32_t, uint32_t> PngSize(const std::string& path) {
  const std::string bytes = FileText(path);
  if (bytes.size() < 24 || bytes.substr(1, 3) != "PNG") return {0, 0};
  const auto number = [&](size_t at) {
    uint32_t value = 0;
    for (size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[i]);
    return value;
  };
  return {number(16), number(20)};
}

class NerfstudioExporterTest : public testing::Test {
 protected:
  void SetUp() override { city_.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}}); }

  std::string Export(const std::string& name) {
    const std::string folder = folder_.path() + "/" + name;
    std::filesystem::create_directory(folder);
    const CityQuestions ask = city_.Ask();
    const auto record = ask.snapshot().GetReconstruction(ReconstructionId(1));
    EXPECT_OK(record);
    const auto model = MakeNerfstudioExporter(ask.snapshot(), {})->Write(*record, folder);
    EXPECT_OK(model);
    EXPECT_TRUE(model.ok() && model->images == 4 && model->points > 100);
    return folder;
  }

  City city_;
  TemporaryFolder folder_;
};

TEST_F(NerfstudioExporterTest, HasEveryFieldAndEveryPhoto) {
  const std::string folder = Export("model");
  const Json transforms = Json::parse(FileText(folder + "/transforms.json"));
  EXPECT_EQ(transforms["camera_model"], "OPENCV");
  for (const char* key : {"k1", "k2", "p1", "p2"}) EXPECT_EQ(transforms[key], 0.0);
  EXPECT_EQ(transforms["applied_transform"],
            Json::parse("[[1.0,0.0,0.0,0.0],[0.0,1.0,0.0,0.0],[0.0,0.0,1.0,0.0]]"));
  EXPECT_EQ(FileText(folder + "/" + std::string(transforms["ply_file_path"])).substr(0, 3), "ply");
  ASSERT_EQ(transforms["frames"].size(), 4u);
  for (const Json& frame : transforms["frames"]) {
    const auto [width, height] = PngSize(folder + "/" + std::string(frame["file_path"]));
    EXPECT_EQ(std::make_pair(width, height), std::make_pair(512u, 384u));
    EXPECT_EQ(frame["w"], 512);
    EXPECT_EQ(frame["h"], 384);
    EXPECT_EQ(frame["fl_x"], 450.0);
    EXPECT_EQ(frame["fl_y"], 450.0);
    EXPECT_EQ(frame["cx"], 256.0) << "half a pixel more than ours";
    EXPECT_EQ(frame["cy"], 192.0);
    EXPECT_OK(city_.Ask().FindImage(frame["veduta_name"]));
  }
}

TEST_F(NerfstudioExporterTest, PointsAreWhereTheirFeaturesAre) {
  const Json transforms = Json::parse(FileText(Export("model") + "/transforms.json"));
  const CityQuestions ask = city_.Ask();
  const Snapshot& snapshot = ask.snapshot();
  std::map<PointId, Eigen::Vector3d> points;
  const auto record = snapshot.GetReconstruction(ReconstructionId(1));
  ASSERT_OK(record);
  ASSERT_OK(
      snapshot.ScanPointBlocks(record->id, record->points_generation, [&](const PointBlock& block) {
        for (const PointRecord& point : block.points) points[point.id] = point.position;
        return true;
      }));
  for (const Json& frame : transforms["frames"]) {
    const auto image = ask.FindImage(frame["veduta_name"]);
    ASSERT_OK(image);
    const auto features = snapshot.GetFeatures(image->photo);
    const auto observations = snapshot.GetObservations(image->id);
    ASSERT_OK(features);
    ASSERT_OK(observations);
    Eigen::Matrix4d world_from_cam;
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column)
        world_from_cam(row, column) =
            frame["transform_matrix"][static_cast<size_t>(row)][static_cast<size_t>(column)];
    }
    std::vector<double> errors;
    for (const Observation& seen : *observations) {
      const Eigen::Vector4d x = world_from_cam.inverse() * points.at(seen.point).homogeneous();
      ASSERT_LT(x.z(), 0);  // it looks along -z
      const double u = double{frame["fl_x"]} * x.x() / -x.z() + double{frame["cx"]};
      const double v = double{frame["cy"]} - double{frame["fl_y"]} * x.y() / -x.z();
      const Keypoint& keypoint = features->keypoints[seen.feature];
      errors.push_back(std::hypot(u - 0.5 - keypoint.x_px, v - 0.5 - keypoint.y_px));
    }
    ASSERT_GT(errors.size(), 50u);
    std::ranges::sort(errors);
    EXPECT_LT(errors[errors.size() / 2], 0.7);
    EXPECT_LT(errors.back(), 6);
  }
}

TEST_F(NerfstudioExporterTest, PhotosAreUndistortedAndAnyNameIsText) {
  const std::string straight = Export("straight");
  Database& database = *city_.parts().database;
  const auto transaction = database.BeginTransaction();
  auto camera = database.GetSnapshot()->GetCamera(CameraId(1));
  ASSERT_OK(camera);
  camera->model.k1 = -0.2;
  transaction->PutCamera(*camera);
  auto image = database.GetSnapshot()->GetImage(ImageId(2));
  ASSERT_OK(image);
  image->name = "gut \xe9 \"b\".jpg";
  transaction->PutImage(*image);
  ASSERT_OK(transaction->Commit());
  const std::string folder = Export("bent");
  const Json transforms = Json::parse(FileText(folder + "/transforms.json"));
  ASSERT_EQ(transforms["frames"].size(), 4u);
  EXPECT_NE(FileText(folder + "/images/000001.png"), FileText(straight + "/images/000001.png"));
  EXPECT_EQ(transforms["frames"][1]["veduta_name"], "gut \xef\xbf\xbd \"b\".jpg");
  for (const Json& frame : transforms["frames"]) {
    EXPECT_EQ(PngSize(folder + "/" + std::string(frame["file_path"])),
              std::make_pair(uint32_t{frame["w"]}, uint32_t{frame["h"]}));
    EXPECT_GT(uint32_t{frame["w"]}, 400u);
  }
}

}  // namespace
}  // namespace veduta
