// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "fusion/export/exporter.h"
#include "fusion/export/model_names.h"
#include "fusion/export/output_file.h"
#include "fusion/export/surface_model.h"
#include "fusion/export/told_scene.h"
#include "fusion/export/undistorted_photos.h"

namespace veduta {
namespace {

// The fields are those of https://docs.nerf.studio/quickstart/data_conventions.html, and the point
// cloud and the transform that its converter from COLMAP writes besides. Rays go through the
// centres of pixels, and the first of them is at (0.5, 0.5) there, as in COLMAP.
constexpr double kPixelOffset = 0.5;

using Json = nlohmann::ordered_json;

// world_from_cam for a camera whose y goes up and whose z goes backward; four rows.
Json TransformMatrix(const Rigid3& cam_from_world) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = cam_from_world.rotation.conjugate().toRotationMatrix() *
                                 Eigen::Vector3d(1, -1, -1).asDiagonal();
  matrix.topRightCorner<3, 1>() = cam_from_world.Center();
  Json rows = Json::array();
  for (Eigen::Index row = 0; row < 4; ++row)
    rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2), matrix(row, 3)});
  return rows;
}

Json FrameOf(const ViewGeometry& view, const std::string& file_path, const std::string& name) {
  return {{"file_path", file_path},
          {"fl_x", view.camera.fx},
          {"fl_y", view.camera.fy},
          {"cx", view.camera.cx + kPixelOffset},
          {"cy", view.camera.cy + kPixelOffset},
          {"w", view.width_px},
          {"h", view.height_px},
          {"transform_matrix", TransformMatrix(view.cam_from_world)},
          {"veduta_name", name}};
}

class NerfstudioExporter final : public Exporter {
 public:
  NerfstudioExporter(const Snapshot& snapshot, bool with_hidden)
      : snapshot_(snapshot), with_hidden_(with_hidden) {}

  Result<ExportedModel> Write(const ReconstructionRecord& record,
                              const std::string& folder) override {
    VEDUTA_ASSIGN_OR_RETURN(const Scene scene, LoadToldScene(snapshot_, record.id, with_hidden_));
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<CloudPoint> points, LoadPoints(snapshot_, record));
    VEDUTA_ASSIGN_OR_RETURN(const auto cloud, OpenPly(folder + "/points.ply", {.normals = false}));
    VEDUTA_RETURN_IF_ERROR(cloud->AddPoints(points));
    VEDUTA_RETURN_IF_ERROR(cloud->Finish().status());
    Json frames = Json::array();
    VEDUTA_RETURN_IF_ERROR(WritePhotos(scene, folder, &frames));
    VEDUTA_RETURN_IF_ERROR(WriteTransforms(folder + "/transforms.json", std::move(frames)));
    return ExportedModel{record.id, folder, scene.images.size(), points.size(), 0, 0};
  }

 private:
  Status WritePhotos(const Scene& scene, const std::string& folder, Json* frames) {
    VEDUTA_ASSIGN_OR_RETURN(const auto photos, WriteUndistorted(snapshot_, scene, folder));
    const std::map<ImageId, std::string> names = ModelNames(scene);
    for (const auto& [id, photo] : photos)
      frames->push_back(FrameOf(photo.geometry, photo.path, names.at(id)));
    return Status::Ok();
  }

  static Status WriteTransforms(const std::string& path, Json frames) {
    const Json transforms = {
        {"camera_model", "OPENCV"},
        {"k1", 0.0},
        {"k2", 0.0},
        {"p1", 0.0},
        {"p2", 0.0},
        {"applied_transform", {{1.0, 0.0, 0.0, 0.0}, {0.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 1.0, 0.0}}},
        {"ply_file_path", "points.ply"},
        {"frames", std::move(frames)}};
    OutputFile file(path);
    // A name that is not UTF-8 must not end the export.
    file.stream() << transforms.dump(1, ' ', false, Json::error_handler_t::replace) << '\n';
    return file.Close();
  }

  const Snapshot& snapshot_;
  const bool with_hidden_;
};

}  // namespace

std::unique_ptr<Exporter> MakeNerfstudioExporter(const Snapshot& snapshot,
                                                 const ExportRequest& request) {
  return std::make_unique<NerfstudioExporter>(snapshot, request.with_hidden);
}

}  // namespace veduta
