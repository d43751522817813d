// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/dense_pass.h"

#include <optional>
#include <set>
#include <string>

#include "engine/journal/journal.h"
#include "fusion/pass/stage.h"
#include "fusion/pass/view_loader.h"
#include "kernels/device.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr uint32_t kDepthSidePx = 512;  // the paper's
constexpr uint32_t kSensorCount = 2;    // the paper's
constexpr uint32_t kSideMax = 65535;    // what a JPEG file can have

// The width of a depth map's pixel on the surface, at the median depth of each image: the median
// over images.
Result<double> FootprintOf(const Scene& scene, uint32_t side_px) {
  std::vector<double> footprints;
  for (const auto& [id, image] : scene.images) {
    std::vector<double> depths;
    for (const SceneObservation& o : image.observations) {
      const double z = (image.cam_from_world * scene.points[o.point].position).z();
      if (z > 0) depths.push_back(z);
    }
    if (depths.empty()) continue;
    footprints.push_back(MedianOf(std::move(depths)) /
                         ViewGeometryOf(image, side_px).camera.focal_px());
  }
  if (!footprints.empty()) return MedianOf(std::move(footprints));
  return Status::InvalidArgument("reconstruction " + std::to_string(scene.reconstruction.id.value) +
                                 " has no points to take a voxel size from");
}

Result<DenseSettings> ChooseSettings(const Snapshot& snapshot, const Scene& scene,
                                     const DensifyOptions& options) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<DenseSettings> last,
                          snapshot.dense().FindSettings(scene.reconstruction.id));
  DenseSettings settings =
      last.value_or(DenseSettings{scene.reconstruction.id, 0, kDepthSidePx, kSensorCount});
  settings.depth_side_px = options.depth_side_px.value_or(settings.depth_side_px);
  settings.sensor_count = options.sensor_count.value_or(settings.sensor_count);
  if (options.voxel_size) {
    settings.voxel_size = *options.voxel_size;
  } else if (!last || last->depth_side_px != settings.depth_side_px) {
    VEDUTA_ASSIGN_OR_RETURN(const double footprint, FootprintOf(scene, settings.depth_side_px));
    settings.voxel_size = options.voxel_px * footprint;
  }
  return settings;
}

Status PutSettings(const DenseSettings& settings, DensePass* pass) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<DenseSettings> last,
                          pass->GetSnapshot()->dense().FindSettings(settings.reconstruction));
  if (last && *last == settings) return Status::Ok();
  return pass->Commit([&](const Snapshot&, Transaction* transaction) {
    // On another grid no tile means anything.
    if (last && last->voxel_size != settings.voxel_size)
      transaction->dense().DeleteReconstruction(settings.reconstruction);
    transaction->dense().PutSettings(settings);
    return Status::Ok();
  });
}

// Writes a pass that has done something into the journal.
Status NoteInJournal(const DensifyReport& report, DensePass* pass) {
  const uint64_t done = report.depths.computed + report.checks.computed + report.volume.computed +
                        report.solutions.computed + report.meshes.computed + report.colors.computed;
  if (done == 0) return Status::Ok();
  return pass->Commit([&](const Snapshot& snapshot, Transaction* transaction) -> Status {
    VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, snapshot.GetState());
    JournalRecord entry;
    entry.actor = "veduta";
    entry.action = "densify";
    entry.reconstruction = report.reconstruction;
    entry.detail = std::to_string(report.depths.computed) + " depth maps made, " +
                   std::to_string(report.depths.kept) + " kept; " +
                   std::to_string(report.meshes.computed) + " tiles made, " +
                   std::to_string(report.meshes.kept) + " kept; " +
                   std::to_string(report.triangles) + " triangles";
    AppendJournal(std::move(entry), &state, transaction);
    transaction->PutState(state);
    return Status::Ok();
  });
}

Status RunPass(const DensifyOptions& options, const DenseSettings& settings, DensePass* pass,
               DensifyReport* report) {
  VEDUTA_RETURN_IF_ERROR(PutSettings(settings, pass));
  VEDUTA_RETURN_IF_ERROR(RunStages(StageOptionsOf(options, settings), pass, report));
  VEDUTA_RETURN_IF_ERROR(
      pass->GetSnapshot()->dense().ScanTiles(pass->reconstruction(), [&](const TileRecord& tile) {
        ++report->tiles;
        report->triangles += tile.triangle_count;
        report->vertices += tile.vertex_count;
        return true;
      }));
  return NoteInJournal(*report, pass);
}

}  // namespace

Status DensifyOptions::Check() const {
  OptionBounds bounds;
  if (depth_side_px && *depth_side_px != 0) {
    const double side = *depth_side_px;
    bounds.Require("depth_side_px", side, side >= 64 && side <= kSideMax,
                   "0 (the photo's) or from 64 to " + std::to_string(kSideMax));
  }
  if (sensor_count) bounds.Between("sensor_count", *sensor_count, 1, 16);
  if (voxel_size) bounds.FiniteAbove("voxel_size", *voxel_size, 0);
  return bounds.AboveUpTo("voxel_px", voxel_px, 0, 100)
      .Between("neighbor_count", neighbor_count, 1, 16)
      .AboveUpTo("moved_px_max", moved_px_max, 0, 10)
      .AboveUpTo("moved_voxels_max", moved_voxels_max, 0, 10)
      .Between("depth_margin", depth_margin, 0, 10)
      .AtLeast("block_pixel_count_min", block_pixel_count_min, 1)
      .AtLeast("block_map_count_min", block_map_count_min, 1)
      .status();
}

Result<DensifyReport> RunDensePass(const DensePassTools& tools, ReconstructionId reconstruction,
                                   const DensifyOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  const auto snapshot = tools.writer.GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const Scene scene, LoadScene(*snapshot, reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(const DenseSettings settings, ChooseSettings(*snapshot, scene, options));
  DensifyReport report;
  report.reconstruction = reconstruction;
  report.device = tools.device ? tools.device->info().name : "C++";
  report.voxel_size = settings.voxel_size;
  report.depth_side_px = settings.depth_side_px;
  report.sensor_count = settings.sensor_count;
  DensePass pass(tools, scene);
  const Status status = RunPass(options, settings, &pass, &report);
  report.merged_into = pass.merged_into();
  if (!status.ok() && !report.merged_into.valid()) return status;
  return report;
}

Result<uint64_t> SweepMerged(Writer& writer) {
  Writer::Turn turn = writer.Take();
  const auto transaction = turn.database().BeginTransaction();
  const auto snapshot = turn.database().GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> records,
                          snapshot->ListReconstructions());
  std::set<ReconstructionId> merged, swept;
  for (const ReconstructionRecord& record : records) {
    if (!record.is_living()) merged.insert(record.id);
  }
  if (merged.empty()) return uint64_t{0};
  DenseWriter& dense = transaction->dense();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<DenseSettings> settings,
                          snapshot->dense().ListSettings());
  for (const DenseSettings& one : settings) {
    if (!merged.contains(one.reconstruction)) continue;
    dense.DeleteReconstruction(one.reconstruction);
    swept.insert(one.reconstruction);
  }
  VEDUTA_RETURN_IF_ERROR(snapshot->dense().ScanDepths([&](const DepthRecord& depth) {
    if (!merged.contains(depth.reconstruction)) return true;
    dense.DeleteDepth(depth.image);
    swept.insert(depth.reconstruction);
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(snapshot->dense().ScanCheckedDepths([&](const CheckedDepthRecord& depth) {
    if (!merged.contains(depth.reconstruction)) return true;
    dense.DeleteCheckedDepth(depth.image, depth.version);
    swept.insert(depth.reconstruction);
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  return swept.size();
}

}  // namespace veduta
