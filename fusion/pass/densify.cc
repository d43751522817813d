// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/densify.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "engine/journal/journal.h"
#include "fusion/pass/pass.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/pass/view_loader.h"

namespace veduta {
namespace {

constexpr uint32_t kDepthSidePx = 512;  // the paper's
constexpr uint32_t kSensorCount = 2;    // likewise
constexpr uint32_t kSideMax = 65535;

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

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
    footprints.push_back(Median(std::move(depths)) /
                         ViewGeometryOf(image, side_px).camera.focal_px());
  }
  if (!footprints.empty()) return Median(std::move(footprints));
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

Status PutSettings(Database& database, const DenseSettings& settings) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<DenseSettings> last,
                          database.GetSnapshot()->dense().FindSettings(settings.reconstruction));
  if (last && *last == settings) return Status::Ok();
  const auto transaction = database.BeginTransaction();
  // On another grid no tile means anything.
  if (last && last->voxel_size != settings.voxel_size)
    transaction->dense().DeleteReconstruction(settings.reconstruction);
  transaction->dense().PutSettings(settings);
  return transaction->Commit();
}

// Notes a pass that has done something.
Status Note(Database& database, const DensifyReport& report) {
  const uint64_t done = report.depths.computed + report.checks.computed + report.volume.computed +
                        report.solutions.computed + report.meshes.computed + report.colors.computed;
  if (done == 0) return Status::Ok();
  const auto transaction = database.BeginTransaction();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, database.GetSnapshot()->GetState());
  AppendJournal(
      {0,
       0,
       "veduta",
       "densify",
       {},
       report.settings.reconstruction,
       std::to_string(report.depths.computed) + " depth maps made, " +
           std::to_string(report.depths.kept) + " kept; " + std::to_string(report.meshes.computed) +
           " tiles made, " + std::to_string(report.meshes.kept) + " kept; " +
           std::to_string(report.triangles) + " triangles"},
      &state, transaction.get());
  transaction->PutState(state);
  return transaction->Commit();
}

}  // namespace

Status DensifyOptions::Check() const {
  const auto broken = [](const char* field, double value, const char* rule) {
    return Status::InvalidArgument(std::string(field) + " is " + std::to_string(value) +
                                   ", but must be " + rule);
  };
  if (depth_side_px && *depth_side_px != 0 && (*depth_side_px < 64 || *depth_side_px > kSideMax)) {
    return broken("depth_side_px", *depth_side_px, "0 (the photo's) or in [64, 65535]");
  }
  if (sensor_count && (*sensor_count < 1 || *sensor_count > 16))
    return broken("sensor_count", *sensor_count, "in [1, 16]");
  if (voxel_size && !(*voxel_size > 0 && std::isfinite(*voxel_size)))
    return broken("voxel_size", *voxel_size, "above 0");
  if (!(voxel_px > 0 && voxel_px <= 100)) return broken("voxel_px", voxel_px, "in (0, 100]");
  if (neighbor_count < 1 || neighbor_count > 16)
    return broken("neighbor_count", neighbor_count, "in [1, 16]");
  if (!(moved_px_max > 0 && moved_px_max <= 10))
    return broken("moved_px_max", moved_px_max, "in (0, 10]");
  if (!(moved_voxels_max > 0 && moved_voxels_max <= 10))
    return broken("moved_voxels_max", moved_voxels_max, "in (0, 10]");
  if (!(depth_margin >= 0 && depth_margin <= 10))
    return broken("depth_margin", depth_margin, "in [0, 10]");
  if (block_pixel_count_min == 0) return broken("block_pixel_count_min", 0, "1 or more");
  if (block_map_count_min == 0) return broken("block_map_count_min", 0, "1 or more");
  return Status::Ok();
}

Status Pass::Tell(std::string_view stage, size_t done, size_t total) const {
  if (options.progress) options.progress(stage, done, total);
  return stop.stop_requested() ? Status::Cancelled("stopped on request: what is finished is stored")
                               : Status::Ok();
}

VersionFeed::VersionFeed(const std::string& stage) {
  *this << kPassVersion << stage;
}

uint64_t VersionFeed::Version() {
  return std::max<uint64_t>(1, Finish().Seed());
}

Status SweepStale(const Pass& pass) {
  const auto snapshot = pass.database.GetSnapshot();
  std::set<DepthVersion> named;
  VEDUTA_RETURN_IF_ERROR(snapshot->dense().ScanDepths([&](const DepthRecord& depth) {
    named.insert({depth.image, 0, depth.checked_version});
    return true;
  }));
  const auto transaction = pass.database.BeginTransaction();
  VEDUTA_RETURN_IF_ERROR(snapshot->dense().ScanCheckedDepths([&](const CheckedDepthRecord& depth) {
    // Another reconstruction's pass may have been killed, and still has to withdraw its superseded
    // maps.
    const bool is_own = depth.reconstruction == pass.scene.reconstruction.id;
    if (is_own && !named.contains({depth.image, 0, depth.version})) {
      transaction->dense().DeleteCheckedDepth(depth.image, depth.version);
    }
    return true;
  }));
  return transaction->Commit();
}

Result<DensifyReport> Densify(Database& database, ReconstructionId reconstruction,
                              const DensifyOptions& options, Device* device, ThreadPool& pool,
                              std::stop_token stop) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  const auto snapshot = database.GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const Scene scene, LoadScene(*snapshot, reconstruction));
  DensifyReport report;
  VEDUTA_ASSIGN_OR_RETURN(report.settings, ChooseSettings(*snapshot, scene, options));
  VEDUTA_RETURN_IF_ERROR(PutSettings(database, report.settings));
  const Pass pass{database, scene, report.settings, device, pool, options, stop};
  VEDUTA_ASSIGN_OR_RETURN(report.depths, UpdateDepths(pass, &report.without_depth));
  VEDUTA_ASSIGN_OR_RETURN(report.checks, CheckDepths(pass));
  VEDUTA_ASSIGN_OR_RETURN(report.volume, UpdateVolume(pass));
  VEDUTA_ASSIGN_OR_RETURN(report.solutions, SolveTiles(pass));
  VEDUTA_ASSIGN_OR_RETURN(report.meshes, ExtractTiles(pass));
  VEDUTA_ASSIGN_OR_RETURN(report.exposures, UpdateExposures(pass));
  VEDUTA_ASSIGN_OR_RETURN(report.colors, ColorTiles(pass));
  VEDUTA_RETURN_IF_ERROR(SweepStale(pass));
  VEDUTA_RETURN_IF_ERROR(
      database.GetSnapshot()->dense().ScanTiles(reconstruction, [&](const TileRecord& tile) {
        ++report.tiles;
        report.triangles += tile.triangle_count;
        report.vertices += tile.vertex_count;
        return true;
      }));
  VEDUTA_RETURN_IF_ERROR(Note(database, report));
  return report;
}

Result<uint64_t> SweepMerged(Database& database) {
  const auto snapshot = database.GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> records,
                          snapshot->ListReconstructions());
  std::set<ReconstructionId> alive;
  for (const ReconstructionRecord& record : records) {
    if (!record.merged_into.valid()) alive.insert(record.id);
  }
  const auto transaction = database.BeginTransaction();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<DenseSettings> settings,
                          snapshot->dense().ListSettings());
  uint64_t count = 0;
  for (const DenseSettings& one : settings) {
    if (alive.contains(one.reconstruction)) continue;
    transaction->dense().DeleteReconstruction(one.reconstruction);
    ++count;
  }
  VEDUTA_RETURN_IF_ERROR(snapshot->dense().ScanDepths([&](const DepthRecord& depth) {
    if (!alive.contains(depth.reconstruction)) transaction->dense().DeleteDepth(depth.image);
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(snapshot->dense().ScanCheckedDepths([&](const CheckedDepthRecord& depth) {
    if (!alive.contains(depth.reconstruction))
      transaction->dense().DeleteCheckedDepth(depth.image, depth.version);
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  return count;
}

}  // namespace veduta
