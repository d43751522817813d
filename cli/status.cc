// SPDX-License-Identifier: Apache-2.0
// veduta status DB [--json]
#include <map>

#include "cli/command.h"

namespace veduta {
namespace {

double MeanError(const ReconstructionRecord& r) {
  return r.observation_count
             ? r.reprojection_error_px_sum / static_cast<double>(r.observation_count)
             : 0;
}

// What the offline pass has made of a reconstruction.
struct Dense {
  uint64_t depth_maps = 0, tiles = 0, triangles = 0;
};

Result<std::map<ReconstructionId, Dense>> CountDense(const Snapshot& snapshot) {
  std::map<ReconstructionId, Dense> counts;
  VEDUTA_RETURN_IF_ERROR(snapshot.dense().ScanDepths([&](const DepthRecord& depth) {
    ++counts[depth.reconstruction].depth_maps;
    return true;
  }));
  for (auto& [id, dense] : counts) {
    VEDUTA_RETURN_IF_ERROR(
        snapshot.dense().ScanTiles(id, [&, count = &dense](const TileRecord& tile) {
          ++count->tiles;
          count->triangles += tile.triangle_count;
          return true;
        }));
  }
  return counts;
}

int PrintStatus(const std::string& db, bool json) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const Result<CityStatus> status = (*engine)->Ask().Status();
  if (!status.ok()) return Fail(status.status());
  const Result<DatabaseSizes> sizes = (*engine)->database()->GetSizes();
  if (!sizes.ok()) return Fail(sizes.status());
  auto dense = CountDense((*engine)->Ask().snapshot());
  if (!dense.ok()) return Fail(dense.status());
  if (json) {
    nlohmann::ordered_json reconstructions = nlohmann::ordered_json::array();
    for (const ReconstructionRecord& r : status->reconstructions) {
      reconstructions.push_back({{"id", r.id.value},
                                 {"images", r.image_count},
                                 {"points", r.point_count},
                                 {"observations", r.observation_count},
                                 {"reprojection_error_px_mean", MeanError(r)},
                                 {"depth_maps", (*dense)[r.id].depth_maps},
                                 {"triangles", (*dense)[r.id].triangles}});
    }
    const nlohmann::ordered_json out = {{"images", status->images},
                                        {"placed", status->placed},
                                        {"postponed", status->postponed},
                                        {"rejected", status->rejected},
                                        {"cameras", status->cameras},
                                        {"backlog", status->backlog},
                                        {"vocabulary_generation", status->vocabulary_generation},
                                        {"bytes", sizes->total_bytes},
                                        {"reconstructions", reconstructions}};
    std::printf("%s\n", out.dump().c_str());
    return kDone;
  }
  std::printf("%lu images: %lu placed, %lu postponed, %lu rejected; %.1f MB\n", status->images,
              status->placed, status->postponed, status->rejected,
              static_cast<double>(sizes->total_bytes) / 1e6);
  for (const ReconstructionRecord& r : status->reconstructions) {
    std::printf(
        "reconstruction %u: %u images, %lu points, %lu observations, mean reprojection error %.3f "
        "px\n",
        r.id.value, r.image_count, r.point_count, r.observation_count, MeanError(r));
    const Dense& d = (*dense)[r.id];
    if (d.depth_maps > 0) {
      std::printf("  dense: %lu depth maps, %lu tiles, %lu triangles\n", d.depth_maps, d.tiles,
                  d.triangles);
    }
  }
  if (status->backlog > 0)
    std::printf("%lu postponed photos are still to be tried again\n", status->backlog);
  return kDone;
}

}  // namespace

void RegisterStatus(CLI::App* app, int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app->add_subcommand("status", "Counts, reconstructions, backlog");
  command->add_option("DB", *db, "Database")->required();
  command->add_flag("--json", *json, "JSON");
  command->callback([=] { *exit_code = PrintStatus(*db, *json); });
}

}  // namespace veduta
