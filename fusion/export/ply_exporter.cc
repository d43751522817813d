// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/earth_file.h"
#include "fusion/export/exporter.h"
#include "fusion/export/moved_model.h"
#include "fusion/export/surface_model.h"

namespace veduta {
namespace {

// The length of a camera's pyramid, as a share of the diagonal of the model's box. Chosen by hand;
// not measured.
constexpr double kCameraDepth = 0.03;

class PlyExporter final : public Exporter {
 public:
  PlyExporter(const Snapshot& snapshot, const ExportRequest& request)
      : snapshot_(snapshot), request_(request) {}

  Result<ExportedModel> Write(const ReconstructionRecord& record,
                              const std::string& folder) override {
    VEDUTA_ASSIGN_OR_RETURN(const SurfaceModel model,
                            LoadSurfaceModel(snapshot_, record, request_.with_hidden));
    VEDUTA_ASSIGN_OR_RETURN(const Eigen::AlignedBox3d box, BoxOf(snapshot_, record.id));
    const Sim3 to_from_world = ModelFromWorld(record, request_);
    VEDUTA_ASSIGN_OR_RETURN(auto as_given, OpenPly(folder + "/points.ply", {.normals = false}));
    const auto points = MoveModel(std::move(as_given), to_from_world);
    VEDUTA_RETURN_IF_ERROR(points->AddPoints(model.points));
    VEDUTA_RETURN_IF_ERROR(points->Finish().status());
    VEDUTA_RETURN_IF_ERROR(
        WriteCameras(folder + "/cameras", MoveCameras(model.cameras, to_from_world),
                     kCameraDepth * to_from_world.scale * box.diagonal().norm()));
    if (!HasSurface(model.tiles)) return model.Counts(folder, {});
    VEDUTA_ASSIGN_OR_RETURN(as_given, OpenPly(folder + "/mesh.ply", {}));
    const auto mesh = MoveModel(std::move(as_given), to_from_world);
    VEDUTA_RETURN_IF_ERROR(AddTiles(snapshot_, model.tiles, request_.error_max, mesh.get()));
    VEDUTA_ASSIGN_OR_RETURN(const ModelCounts counts, mesh->Finish());
    return model.Counts(folder, counts);
  }

 private:
  const Snapshot& snapshot_;
  const ExportRequest request_;
};

}  // namespace

std::unique_ptr<Exporter> MakePlyExporter(const Snapshot& snapshot, const ExportRequest& request) {
  return std::make_unique<PlyExporter>(snapshot, request);
}

}  // namespace veduta
