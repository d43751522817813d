// SPDX-License-Identifier: Apache-2.0
// Goal: a model on the earth is the reconstruction's, moved; earth.json says where either is.
// Method: a writer that remembers what comes; a place that is given; the file read again.
#include "fusion/export/earth_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "fusion/export/moved_model.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

// Half a metre for each unit; x becomes north.
const Sim3 kMoved{
    0.5, Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {10, 20, 30}};

ReconstructionRecord Record(bool is_known) {
  ReconstructionRecord record;
  record.id = ReconstructionId(1);
  record.georeference.version = 4;
  if (!is_known) return record;
  EarthPlace& place = record.georeference.place.emplace();
  place.origin = {47.5, 15.25, 350};
  place.enu_from_world = kMoved;
  return record;
}

struct Remembered {
  TriangleMesh mesh;
  std::vector<CloudPoint> points;
  std::vector<ExportedCamera> cameras;
};

class Remembering final : public ModelWriter {
 public:
  explicit Remembering(Remembered* into) : into_(into) {}
  Status AddMesh(const TriangleMesh& mesh, std::span<const uint64_t>) override {
    into_->mesh = mesh;
    return Status::Ok();
  }
  Status AddPoints(std::span<const CloudPoint> points) override {
    into_->points.assign(points.begin(), points.end());
    return Status::Ok();
  }
  Status AddCameras(std::span<const ExportedCamera> cameras) override {
    into_->cameras.assign(cameras.begin(), cameras.end());
    return Status::Ok();
  }
  Result<ModelCounts> Finish() override { return ModelCounts{1, 2, 3, 4}; }

 private:
  Remembered* const into_;
};

TEST(MoveModel, MovesAllOfIt) {
  Remembered got;
  const auto writer = MoveModel(std::make_unique<Remembering>(&got), kMoved);
  TriangleMesh mesh;
  mesh.positions = {{2, 0, 0}};
  mesh.normals = {{1, 0, 0}};
  ASSERT_OK(writer->AddMesh(mesh, {}));
  ASSERT_EQ(got.mesh.positions.size(), 1u);
  EXPECT_LT((got.mesh.positions[0] - Eigen::Vector3f(10, 21, 30)).norm(), 1e-5);
  EXPECT_LT((got.mesh.normals[0] - Eigen::Vector3f(0, 1, 0)).norm(), 1e-6);
  CloudPoint point;
  point.position = {0, 0, 4};
  ASSERT_OK(writer->AddPoints({&point, 1}));
  EXPECT_LT((got.points.at(0).position - Eigen::Vector3f(10, 20, 32)).norm(), 1e-5);
  EXPECT_TRUE(got.points.at(0).normal.isZero());
  ExportedCamera camera;
  camera.name = "a.jpg";
  camera.geometry.cam_from_world = {Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {1, 2, 3}};
  ASSERT_OK(writer->AddCameras({&camera, 1}));
  const Rigid3 before = camera.geometry.cam_from_world,
               after = got.cameras.at(0).geometry.cam_from_world;
  EXPECT_LT((after.Center() - kMoved * before.Center()).norm(), 1e-12);
  // What the camera sees where does not change.
  const Eigen::Vector3d x(3, -1, 7);
  EXPECT_LT((after * (kMoved * x) - 0.5 * (before * x)).norm(), 1e-12);
  EXPECT_EQ(writer->Finish()->triangles, 2u);
}

nlohmann::json FileOf(const ReconstructionRecord& record, bool on_earth) {
  const TemporaryFolder folder;
  const std::string path = folder / "earth.json";
  ExportRequest request;
  request.on_earth = on_earth;
  EXPECT_OK(WriteEarthFile(record, request, path));
  if (!std::filesystem::exists(path)) return nullptr;
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

TEST(EarthFile, SaysWhereTheModelIs) {
  const nlohmann::json own = FileOf(Record(true), false);
  EXPECT_EQ(own["origin"]["latitude"], 47.5);
  EXPECT_EQ(own["origin"]["longitude"], 15.25);
  EXPECT_EQ(own["origin"]["height"], 350);
  EXPECT_EQ(own["scale"], 0.5);
  EXPECT_EQ(own["translation"], (std::vector<double>{10, 20, 30}));
  EXPECT_EQ(own["version"], 4);
  const nlohmann::json moved = FileOf(Record(true), true);
  EXPECT_EQ(moved["origin"], own["origin"]);
  EXPECT_EQ(moved["scale"], 1);
  EXPECT_EQ(moved["rotation_wxyz"], (std::vector<double>{1, 0, 0, 0}));
  EXPECT_EQ(moved["translation"], (std::vector<double>{0, 0, 0}));
  EXPECT_TRUE(FileOf(Record(false), true).is_null());
}

TEST(EarthFile, OnlyWhatHasAPlaceIsMoved) {
  ExportRequest request;
  EXPECT_FALSE(IsOnEarth(Record(true), request));
  EXPECT_EQ(ModelFromWorld(Record(true), request).scale, 1);
  request.on_earth = true;
  EXPECT_TRUE(IsOnEarth(Record(true), request));
  EXPECT_EQ(ModelFromWorld(Record(true), request).scale, 0.5);
  EXPECT_FALSE(IsOnEarth(Record(false), request));
  EXPECT_EQ(ModelFromWorld(Record(false), request).scale, 1);
}

TEST(EarthFile, AFolderThatIsNotThereIsNamed) {
  const Status failed = WriteEarthFile(Record(true), {}, "/no such folder/earth.json");
  EXPECT_EQ(failed.code(), StatusCode::kIoError);
  EXPECT_NE(failed.message().find("/no such folder/earth.json"), std::string::npos);
}

}  // namespace
}  // namespace veduta
