// SPDX-License-Identifier: Apache-2.0
// veduta densify DB [--reconstruction ID] [--threads N] [--device D] [--size PX] [--sensors N]
// [--voxel V] [--hours H] [--json]
#include "cli/command.h"
#include "cli/owner_beside.h"
#include "cli/progress.h"
#include "cli/service/pass_time.h"
#include "cli/stop_on_signal.h"
#include "cli/wire/dense_json.h"

namespace veduta {
namespace {

struct DensifyArguments {
  std::string db;
  uint32_t reconstruction = 0, threads = 0;
  DensifyRequest request;
  double hours = 0;  // 0: as long as it takes
  bool json = false;
};

// A bar, or lines, for each stage of the pass.
class StageProgress final {
 public:
  void Tell(std::string_view stage, size_t done, size_t total) {
    if (!progress_ || stage != stage_) {
      progress_.reset();  // which erases the bar of the stage before
      stage_ = stage;
      progress_ = std::make_unique<Progress>(total, stage_);
    }
    progress_->Set(done);
  }
  // Nothing is under way until the next stage is told.
  void End() { progress_.reset(); }

 private:
  std::string stage_;
  std::unique_ptr<Progress> progress_;
};

void PrintStage(const char* name, const StageCount& count) {
  const std::string removed =
      count.removed ? ", " + std::to_string(count.removed) + " removed" : "";
  PrintLine("  %-11s %6lu computed, %6lu kept%s  %9.1f s", name, count.computed, count.kept,
            removed.c_str(), count.ms / 1000);
}

void PrintReport(const DensifyReport& report) {
  PrintLine("reconstruction %u on %s: %lu tiles, %lu vertices, %lu triangles, voxel %.4g",
            report.reconstruction.value, Printable(report.device).c_str(), report.tiles,
            report.vertices, report.triangles, report.voxel_size);
  PrintStage("depth maps", report.depths);
  PrintStage("checks", report.checks);
  PrintStage("volume", report.volume);
  if (report.volume.units > 0) PrintLine("              %6lu blocks changed", report.volume.units);
  PrintStage("fusion", report.solutions);
  PrintStage("surface", report.meshes);
  PrintStage("exposures", report.exposures);
  PrintStage("colours", report.colors);
  for (const PassedOver& photo : report.without_depth) {
    PrintLine("  no depth map of %s: %s", Printable(photo.name).c_str(),
              Printable(photo.reason).c_str());
  }
}

int Densify(const DensifyArguments& arguments) {
  DensifyRequest request = arguments.request;
  request.reconstruction = ReconstructionId(arguments.reconstruction);
  request.cache_folder = ProgramCacheFolder();
  StageProgress progress;
  request.report = [&](const DensifyReport& report) {
    progress.End();
    if (!report.why_cpp.empty()) {
      std::fprintf(stderr, "%s; C++ does the work\n", Printable(report.why_cpp).c_str());
    }
    if (arguments.json) {
      PrintJson(ToJson(report));
    } else {
      PrintReport(report);
    }
  };
  if (auto daemon = DaemonClient::Connect(arguments.db)) {
    WarnOfThreads(arguments.threads);
    const Status done = DensifyBeside(&*daemon, request, arguments.hours);
    return done.ok() ? kDone : Fail(done);
  }
  const StopOnSignal stop;
  EngineOptions options;
  options.thread_count = arguments.threads;
  const auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  PassTime time(arguments.hours, stop.token());
  request.progress = [&](std::string_view stage, size_t done, size_t total) {
    progress.Tell(stage, done, total);
    time.Look();
  };
  const auto reports = (*engine)->Densify(request, time.token());
  progress.End();
  const Status done = time.EndOf(reports.status());
  return done.ok() ? kDone : Fail(done);
}

}  // namespace

void RegisterDensify(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<DensifyArguments>();
  DensifyRequest& request = arguments->request;
  CLI::App* command = app->add_subcommand(
      "densify", "Depth maps and a coloured surface, for what is stale; restartable");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("--reconstruction", arguments->reconstruction, "One only (default: all)")
      ->check(AboveZero());
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command->add_option("--device", request.device,
                      "auto, gpu, cpu, an index or a part of the name as `veduta devices` lists "
                      "them, or cpp for none");
  command->add_option(
      "--size", request.options.depth_side_px,
      "Longer side of a depth map, px; 0: the photo's (default: as last time, 512 at first)");
  command
      ->add_option("--sensors", request.options.sensor_count,
                   "Photos that each depth map is computed from besides its own (default: as last "
                   "time, 2 at first)")
      ->check(CLI::Range(1, 16));
  command
      ->add_option(
          "--voxel", request.options.voxel_size,
          "Edge of a voxel in the reconstruction's units (default: as last time, 1.5 px at first)")
      ->check(AboveZero());
  command
      ->add_option("--hours", arguments->hours,
                   "Stop before the next piece once so much time is over; what is finished is "
                   "stored, and the same command goes on (default: as long as it takes)")
      ->check(AboveZero())
      ->check(CLI::Range(0.0, kPassHoursMax));
  command->add_flag("--json", arguments->json, "One JSON object per reconstruction");
  command->callback([=] { *exit_code = Densify(*arguments); });
}

}  // namespace veduta
