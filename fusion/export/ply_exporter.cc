// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/exporter.h"
#include "fusion/export/surface_model.h"

namespace veduta {
namespace {

// The length of a camera's pyramid, as a share of the diagonal of the model's box. Chosen by hand;
// not measured.
constexpr double kCameraDepth = 0.03;

class PlyExporter final : public Exporter {
 public:
  PlyExporter(const Snapshot& snapshot, double error_max)
      : snapshot_(snapshot), error_max_(error_max) {}

  Result<ExportedModel> Write(const ReconstructionRecord& record,
                              const std::string& folder) override {
    VEDUTA_ASSIGN_OR_RETURN(const SurfaceModel model, LoadSurfaceModel(snapshot_, record));
    VEDUTA_ASSIGN_OR_RETURN(const Eigen::AlignedBox3d box, BoxOf(snapshot_, record.id));
    VEDUTA_ASSIGN_OR_RETURN(const auto points, OpenPly(folder + "/points.ply", {.normals = false}));
    VEDUTA_RETURN_IF_ERROR(points->AddPoints(model.points));
    VEDUTA_RETURN_IF_ERROR(points->Finish().status());
    VEDUTA_RETURN_IF_ERROR(
        WriteCameras(folder + "/cameras", model.cameras, kCameraDepth * box.diagonal().norm()));
    if (!HasSurface(model.tiles)) return model.Counts(folder, {});
    VEDUTA_ASSIGN_OR_RETURN(const auto mesh, OpenPly(folder + "/mesh.ply", {}));
    VEDUTA_RETURN_IF_ERROR(AddTiles(snapshot_, model.tiles, error_max_, mesh.get()));
    VEDUTA_ASSIGN_OR_RETURN(const ModelCounts counts, mesh->Finish());
    return model.Counts(folder, counts);
  }

 private:
  const Snapshot& snapshot_;
  const double error_max_;
};

}  // namespace

std::unique_ptr<Exporter> MakePlyExporter(const Snapshot& snapshot, const ExportRequest& request) {
  return std::make_unique<PlyExporter>(snapshot, request.error_max);
}

}  // namespace veduta
