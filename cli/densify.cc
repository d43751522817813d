// SPDX-License-Identifier: Apache-2.0
// veduta densify DB [--reconstruction ID] [--threads N] [--device D] [--size PX] [--sensors N]
// [--voxel V] [--json]
#include <cstdlib>

#include "cli/command.h"
#include "cli/progress.h"
#include "cli/stop_on_signal.h"
#include "fusion/pass/densify.h"
#include "kernels/device.h"

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

// The device asked for; null, with a word why, where the C++ paths are to work.
Result<std::unique_ptr<Device>> OpenDevice(const DensifyArguments& arguments) {
  if (WantsNoDevice(arguments.device)) return std::unique_ptr<Device>();
  Result<std::unique_ptr<Device>> device = Device::Open({.wanted = arguments.device,
                                                         .cache_folder = ProgramCacheFolder(),
                                                         .thread_count = arguments.threads});
  if (device.ok() || arguments.device != "auto") return device;
  std::fprintf(stderr, "%s; C++ does the work\n", device.status().message().c_str());
  return std::unique_ptr<Device>();
}

Result<std::vector<ReconstructionId>> Wanted(const Engine& engine, uint32_t reconstruction) {
  if (reconstruction != 0) return std::vector{ReconstructionId(reconstruction)};
  std::vector<ReconstructionId> wanted;
  VEDUTA_ASSIGN_OR_RETURN(const auto records, engine.Ask().snapshot().ListReconstructions());
  for (const ReconstructionRecord& record : records) {
    if (!record.merged_into.valid()) wanted.push_back(record.id);
  }
  return wanted;
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

void PrintJson(ReconstructionId id, const DensifyReport& report, const std::string& device) {
  nlohmann::ordered_json without_depth = nlohmann::ordered_json::array();
  for (const PassedOver& photo : report.without_depth) {
    without_depth.push_back({{"image", photo.name}, {"reason", photo.reason}});
  }
  const nlohmann::ordered_json line = {{"reconstruction", id.value},
                                       {"device", device},
                                       {"voxel_size", report.settings.voxel_size},
                                       {"depth_side_px", report.settings.depth_side_px},
                                       {"sensor_count", report.settings.sensor_count},
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

void PrintText(ReconstructionId id, const DensifyReport& report, const std::string& device) {
  std::printf("reconstruction %u on %s: %lu tiles, %lu vertices, %lu triangles, voxel %.4g\n",
              id.value, device.c_str(), report.tiles, report.vertices, report.triangles,
              report.settings.voxel_size);
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
  const auto device = OpenDevice(arguments);
  if (!device.ok()) return Fail(device.status());
  const std::string device_name = *device ? (*device)->info().name : "C++";
  const auto swept = SweepMerged(*(*engine)->database());
  if (!swept.ok()) return Fail(swept.status());
  const auto wanted = Wanted(**engine, arguments.reconstruction);
  if (!wanted.ok()) return Fail(wanted.status());
  if (wanted->empty())
    return Fail(Status::NotFound("there is no reconstruction yet: add photos first"));
  for (const ReconstructionId id : *wanted) {
    StageProgress progress;
    arguments.options.progress = [&](std::string_view stage, size_t done, size_t total) {
      progress(stage, done, total);
    };
    const auto report = veduta::Densify(*(*engine)->database(), id, arguments.options,
                                        device->get(), *(*engine)->pool(), stop.token());
    if (!report.ok()) return Fail(report.status());
    progress = {};
    if (arguments.json) {
      PrintJson(id, *report, device_name);
    } else {
      PrintText(id, *report, device_name);
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
