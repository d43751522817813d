// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/earth_file.h"
#include "fusion/export/exporter.h"
#include "fusion/export/moved_model.h"
#include "fusion/export/surface_model.h"

namespace veduta {
namespace {

class GltfExporter final : public Exporter {
 public:
  GltfExporter(const Snapshot& snapshot, const ExportRequest& request)
      : snapshot_(snapshot), request_(request) {}

  Result<ExportedModel> Write(const ReconstructionRecord& record,
                              const std::string& folder) override {
    VEDUTA_ASSIGN_OR_RETURN(const SurfaceModel model,
                            LoadSurfaceModel(snapshot_, record, request_.with_hidden));
    const bool is_on_earth = IsOnEarth(record, request_);
    const Eigen::Vector3d up =
        is_on_earth ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : MeanUp(model.upright_cams);
    VEDUTA_ASSIGN_OR_RETURN(auto as_given, OpenGlb(folder + "/model.glb", {}, up));
    const auto writer = MoveModel(std::move(as_given), ModelFromWorld(record, request_));
    VEDUTA_RETURN_IF_ERROR(AddTiles(snapshot_, model.tiles, request_.error_max, writer.get()));
    VEDUTA_RETURN_IF_ERROR(writer->AddPoints(model.points));
    VEDUTA_RETURN_IF_ERROR(writer->AddCameras(model.cameras));
    VEDUTA_ASSIGN_OR_RETURN(const ModelCounts counts, writer->Finish());
    return model.Counts(folder, counts);
  }

 private:
  const Snapshot& snapshot_;
  const ExportRequest request_;
};

}  // namespace

std::unique_ptr<Exporter> MakeGltfExporter(const Snapshot& snapshot, const ExportRequest& request) {
  return std::make_unique<GltfExporter>(snapshot, request);
}

}  // namespace veduta
