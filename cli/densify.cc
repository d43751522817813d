// SPDX-License-Identifier: Apache-2.0
// veduta densify DB [--reconstruction ID] [--threads N] [--device D] [--size PX] [--sensors N]
// [--voxel V] [--json]
#include <cstdlib>
#include <mutex>

#include "cli/command.h"
#include "cli/progress.h"
#include "cli/stop_on_signal.h"
#include "fusion/dense_door.h"

namespace veduta {
namespace {

struct DensifyArguments {
  std::string db, device = "auto";
  uint32_t reconstruction = 0, threads = 0;
  DensifyOptions options;
  bool json = false;
};

// Where built programs are kept; empty, and they are built each time, where the user has no such
// folder.
std::string ProgramCacheFolder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache)
    return std::string(cache) + "/veduta";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::string(home) + "/.cache/veduta";
  return "";
}

// A bar or lines for each stage.
class StageProgress final {
 public:
  void operator()(std::string_view stage, size_t done, size_t total) {
    if (stage != stage_) {
      stage_ = stage;
      progress_ = std::make_unique<Progress>(total, stage_);
    }
    progress_->Set(done);
  }

 private:
  std::string stage_;
  std::unique_ptr<Progress> progress_;
};

nlohmann::ordered_json ToJson(const StageCount& count) {
  return {{"computed", count.computed},
          {"kept", count.kept},
          {"removed", count.removed},
          {"ms", count.ms}};
}

void PrintJson(const DensifyReport& report) {
  nlohmann::ordered_json without_depth = nlohmann::ordered_json::array();
  for (const PassedOver& photo : report.without_depth) {
    without_depth.push_back({{"image", photo.name}, {"reason", photo.reason}});
  }
  const nlohmann::ordered_json line = {{"reconstruction", report.reconstruction.value},
                                       {"device", report.device},
                                       {"voxel_size", report.voxel_size},
                                       {"depth_side_px", report.depth_side_px},
                                       {"sensor_count", report.sensor_count},
                                       {"without_depth", without_depth},
                                       {"depth_maps", ToJson(report.depths)},
                                       {"checks", ToJson(report.checks)},
                                       {"volume", ToJson(report.volume)},
                                       {"blocks_changed", report.volume.units},
                                       {"fusion", ToJson(report.solutions)},
                                       {"surface", ToJson(report.meshes)},
                                       {"exposures", ToJson(report.exposures)},
                                       {"colours", ToJson(report.colors)},
                                       {"tiles", report.tiles},
                                       {"vertices", report.vertices},
                                       {"triangles", report.triangles}};
  std::printf("%s\n",
              line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
  std::fflush(stdout);
}

void PrintStage(const char* name, const StageCount& count) {
  const std::string removed =
      count.removed ? ", " + std::to_string(count.removed) + " removed" : "";
  std::printf("  %-11s %6lu computed, %6lu kept%s  %9.1f s\n", name, count.computed, count.kept,
              removed.c_str(), count.ms / 1000);
}

void PrintText(const DensifyReport& report) {
  std::printf("reconstruction %u on %s: %lu tiles, %lu vertices, %lu triangles, voxel %.4g\n",
              report.reconstruction.value, report.device.c_str(), report.tiles, report.vertices,
              report.triangles, report.voxel_size);
  PrintStage("depth maps", report.depths);
  PrintStage("checks", report.checks);
  PrintStage("volume", report.volume);
  if (report.volume.units > 0)
    std::printf("              %6lu blocks changed\n", report.volume.units);
  PrintStage("fusion", report.solutions);
  PrintStage("surface", report.meshes);
  PrintStage("exposures", report.exposures);
  PrintStage("colours", report.colors);
  for (const PassedOver& photo : report.without_depth) {
    std::printf("  no depth map of %s: %s\n", photo.name.c_str(), photo.reason.c_str());
  }
  std::fflush(stdout);
}

int Densify(DensifyArguments arguments) {
  const StopOnSignal stop;
  EngineOptions options;
  options.thread_count = arguments.threads;
  const auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  Writer writer((*engine)->database());
  std::mutex one_pass;
  StageProgress progress;
  DensifyRequest request;
  request.reconstruction = ReconstructionId(arguments.reconstruction);
  request.device = arguments.device;
  request.cache_folder = ProgramCacheFolder();
  request.options = arguments.options;
  request.progress = [&](std::string_view stage, size_t done, size_t total) {
    progress(stage, done, total);
  };
  const auto reports = DensifyAll(writer, *(*engine)->pool(), one_pass, request, stop.token());
  if (!reports.ok()) return Fail(reports.status());
  progress = {};
  for (const DensifyReport& report : *reports) {
    if (arguments.json) {
      PrintJson(report);
    } else {
      PrintText(report);
    }
  }
  return kDone;
}

}  // namespace

void RegisterDensify(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<DensifyArguments>();
  CLI::App* command = app->add_subcommand(
      "densify", "Depth maps and a coloured surface, for what is stale; restartable");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("--reconstruction", arguments->reconstruction, "One only (default: all)")
      ->check(CLI::PositiveNumber);
  command->add_option("--threads", arguments->threads, "Threads (default: one a core)")
      ->check(CLI::Range(1, 1024));
  command->add_option("--device", arguments->device,
                      "auto, gpu, cpu, an index or a part of the name as `veduta devices` lists "
                      "them, or cpp for none");
  command->add_option(
      "--size", arguments->options.depth_side_px,
      "Longer side of a depth map, px; 0: the photo's (default: as last time, 512 at first)");
  command
      ->add_option("--sensors", arguments->options.sensor_count,
                   "Photos that each depth map is computed from besides its own (default: as last "
                   "time, 2 at first)")
      ->check(CLI::Range(1, 16));
  command
      ->add_option(
          "--voxel", arguments->options.voxel_size,
          "Edge of a voxel in the reconstruction's units (default: as last time, 1.5 px at first)")
      ->check(CLI::PositiveNumber);
  command->add_flag("--json", arguments->json, "One JSON object a reconstruction");
  command->callback([=] { *exit_code = Densify(*arguments); });
}

}  // namespace veduta
