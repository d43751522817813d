// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/dense_pass.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include "engine/journal/journal.h"
#include "fusion/pass/run_stages.h"
#include "fusion/pass/staged_surface.h"
#include "fusion/pass/view_loader.h"
#include "fusion/volume/grid.h"
#include "kernels/device.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr uint32_t kDepthSidePx = 512;  // the paper's
constexpr uint32_t kSensorCount = 2;    // the paper's
constexpr uint32_t kSideMax = 65535;    // what a JPEG file can have
// Of a pass that photos are taken out under. Chosen by hand.
constexpr int kAttemptsMax = 4;

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

// How wide the reconstruction is: the longest side of the box that holds its points, without the
// hundredth of them that lies farthest out on either side.
double WidthOf(const Scene& scene) {
  constexpr double kOutside = 0.01;  // chosen by hand; not measured: mistriangulated points
  double width = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const ScenePoint& point : scene.points) values.push_back(point.position[axis]);
    if (values.empty()) return 0;
    const double low = QuantileInPlace(values, kOutside);
    width = std::max(width, QuantileInPlace(values, 1 - kOutside) - low);
  }
  return width;
}

std::string Short(double value) {
  std::ostringstream text;
  text.precision(4);
  text << value;
  return text.str();
}

// A grid on which there can be a surface. At least, one block is as wide as a pixel of a depth map:
// through a narrower one hardly any pixel passes, and it is not allocated. At most, the
// reconstruction is as wide as one block.
Status CheckVoxelSize(const Scene& scene, const DenseSettings& settings) {
  VEDUTA_ASSIGN_OR_RETURN(const double footprint, FootprintOf(scene, settings.depth_side_px));
  const double width = WidthOf(scene);
  const double least = footprint / kBlockSide, most = width / kBlockSide;
  if (settings.voxel_size >= least && settings.voxel_size <= most) return Status::Ok();
  const double blocks = std::pow(std::max(1.0, width / (kBlockSide * settings.voxel_size)), 2);
  const std::string size = "voxel size " + Short(settings.voxel_size);
  const std::string model = "reconstruction " + std::to_string(scene.reconstruction.id.value) +
                            ", which is " + Short(width) + " wide";
  const std::string range =
      "; give --voxel a size from " + Short(least) + " to " + Short(most) + ". Nothing was changed";
  if (settings.voxel_size > most) {
    return Status::InvalidArgument(size + " is too large for " + model +
                                   ": all of it would lie in one block of " +
                                   std::to_string(kBlockSide) + " voxels a side" + range);
  }
  return Status::InvalidArgument(
      size + " is too small for " + model + ": a surface across it would take some " +
      Short(blocks) + " blocks (" + Short(blocks * kBlockVoxels) + " bytes and more), each " +
      "narrower than a pixel of the depth maps, which is " + Short(footprint) + " wide" + range);
}

Result<DenseSettings> ChooseSettings(const Snapshot& snapshot, const Scene& scene,
                                     const DensifyOptions& options) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<DenseSettings> last,
                          FindLastSettings(snapshot, scene.reconstruction.id));
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
  if (!last || last->voxel_size != settings.voxel_size)
    VEDUTA_RETURN_IF_ERROR(CheckVoxelSize(scene, settings));
  return settings;
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

Status RunPass(const DensifyOptions& options, DensePass* pass, DensifyReport* report) {
  VEDUTA_RETURN_IF_ERROR(FinishMove(pass));
  VEDUTA_ASSIGN_OR_RETURN(const DenseSettings settings,
                          ChooseSettings(*pass->GetSnapshot(), pass->scene(), options));
  report->voxel_size = settings.voxel_size;
  report->depth_side_px = settings.depth_side_px;
  report->sensor_count = settings.sensor_count;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId surface, BeginSurface(settings, pass));
  pass->set_surface(surface);
  VEDUTA_RETURN_IF_ERROR(RunStages(StageOptionsOf(options, settings), pass, report));
  VEDUTA_RETURN_IF_ERROR(FinishMove(pass));
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
  for (int attempt = 1;; ++attempt) {
    const auto snapshot = tools.writer.GetSnapshot();
    VEDUTA_ASSIGN_OR_RETURN(const Scene scene, LoadScene(*snapshot, reconstruction));
    DensifyReport report;
    report.reconstruction = reconstruction;
    report.device = tools.device ? tools.device->info().name : "C++";
    DensePass pass(tools, scene);
    const Status status = RunPass(options, &pass, &report);
    report.merged_into = pass.merged_into();
    report.dissolved = pass.dissolved();
    if (status.ok() || report.merged_into.valid() || report.dissolved) return report;
    // A piece that reads what others have deleted meanwhile does not find it.
    const bool was_overtaken = pass.is_overtaken() || status.code() == StatusCode::kNotFound;
    if (!was_overtaken || attempt == kAttemptsMax) return status;
  }
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
    const ReconstructionId owner = OwnerOfSurface(one.reconstruction);
    if (!merged.contains(owner)) continue;
    dense.DeleteReconstruction(one.reconstruction);
    swept.insert(owner);
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
