// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/exporter.h"
#include "fusion/export/surface_model.h"

namespace veduta {
namespace {

class GltfExporter final : public Exporter {
 public:
  GltfExporter(const Snapshot& snapshot, double error_max)
      : snapshot_(snapshot), error_max_(error_max) {}

  Result<ExportedModel> Write(const ReconstructionRecord& record,
                              const std::string& folder) override {
    VEDUTA_ASSIGN_OR_RETURN(const SurfaceModel model, LoadSurfaceModel(snapshot_, record));
    std::vector<ViewGeometry> views;
    for (const ExportedCamera& camera : model.cameras) views.push_back(camera.geometry);
    VEDUTA_ASSIGN_OR_RETURN(const auto writer, OpenGlb(folder + "/model.glb", {}, MeanUp(views)));
    VEDUTA_RETURN_IF_ERROR(AddTiles(snapshot_, model.tiles, error_max_, writer.get()));
    VEDUTA_RETURN_IF_ERROR(writer->AddPoints(model.points));
    VEDUTA_RETURN_IF_ERROR(writer->AddCameras(model.cameras));
    VEDUTA_ASSIGN_OR_RETURN(const ModelCounts counts, writer->Finish());
    return model.Counts(folder, counts);
  }

 private:
  const Snapshot& snapshot_;
  const double error_max_;
};

}  // namespace

std::unique_ptr<Exporter> MakeGltfExporter(const Snapshot& snapshot, const ExportRequest& request) {
  return std::make_unique<GltfExporter>(snapshot, request.error_max);
}

}  // namespace veduta
