// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/moved_model.h"

#include <utility>

namespace veduta {
namespace {

class MovedModel final : public ModelWriter {
 public:
  MovedModel(std::unique_ptr<ModelWriter> writer, const Sim3& to_from_world)
      : writer_(std::move(writer)), to_from_world_(to_from_world) {}

  Status AddMesh(const TriangleMesh& mesh, std::span<const uint64_t> keys) override {
    TriangleMesh moved = mesh;
    for (Eigen::Vector3f& position : moved.positions) position = Moved(position);
    for (Eigen::Vector3f& normal : moved.normals) normal = Turned(normal);
    return writer_->AddMesh(moved, keys);
  }

  Status AddPoints(std::span<const CloudPoint> points) override {
    std::vector<CloudPoint> moved(points.begin(), points.end());
    for (CloudPoint& point : moved) {
      point.position = Moved(point.position);
      point.normal = Turned(point.normal);
    }
    return writer_->AddPoints(moved);
  }

  Status AddCameras(std::span<const ExportedCamera> cameras) override {
    return writer_->AddCameras(MoveCameras({cameras.begin(), cameras.end()}, to_from_world_));
  }

  Result<ModelCounts> Finish() override { return writer_->Finish(); }

 private:
  Eigen::Vector3f Moved(const Eigen::Vector3f& x) const {
    return (to_from_world_ * x.cast<double>()).cast<float>();
  }
  Eigen::Vector3f Turned(const Eigen::Vector3f& x) const {
    return (to_from_world_.rotation * x.cast<double>()).cast<float>();
  }

  const std::unique_ptr<ModelWriter> writer_;
  const Sim3 to_from_world_;
};

}  // namespace

std::unique_ptr<ModelWriter> MoveModel(std::unique_ptr<ModelWriter> writer,
                                       const Sim3& to_from_world) {
  return std::make_unique<MovedModel>(std::move(writer), to_from_world);
}

std::vector<ExportedCamera> MoveCameras(std::vector<ExportedCamera> cameras,
                                        const Sim3& to_from_world) {
  for (ExportedCamera& camera : cameras) {
    Rigid3& pose = camera.geometry.cam_from_world;
    pose = TransformCameraWorld(to_from_world, pose);
  }
  return cameras;
}

}  // namespace veduta
