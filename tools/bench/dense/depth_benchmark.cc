// SPDX-License-Identifier: Apache-2.0
// veduta-bench-dense: depth maps against truth. Exit codes: 0 done; 1 it could not be done; 2
// bad usage.
#include "tools/bench/dense/depth_benchmark.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

namespace veduta {
namespace {

int Run(int argc, char** argv) {
  CLI::App app("Depth maps against truth");
  std::string pairs, street;
  std::string wanted = "cpp";
  uint32_t threads = 2, keys = 15;
  bool no_sgbm = false, timing = false;
  BenchmarkSetting setting;
  DepthOptions& depth = setting.depth;
  app.add_option("--pairs", pairs, "folder of Cones, Cloth3, Wood2 and Aloe");
  app.add_flag("--no-sgbm", no_sgbm, "without OpenCV's search for its best settings");
  app.add_flag("--time", timing, "time of one triple of views");
  app.add_option("--street", street, "folder that veduta-street --depth wrote");
  app.add_option("--keys", keys, "key views of the street (15)")->check(CLI::Range(1, 10000));
  app.add_option("--device", wanted, "as veduta devices takes it; cpp: none (cpp)");
  app.add_option("--threads", threads, "(2)")->check(CLI::Range(1, 256));
  app.add_option("--pictures", setting.pictures, "folder for PNGs");
  app.add_option("--plane-step", depth.plane_step_px, "px");
  app.add_option("--planes", depth.plane_count_max, "at most");
  app.add_option("--refinements", depth.refinement_count, "sweeps along the surface");
  app.add_option("--volume-bytes", depth.volume_bytes_max, "at most");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  ThreadPool pool(threads - 1);
  setting.pool = &pool;
  std::unique_ptr<Device> device;
  Status status;
  if (!WantsNoDevice(wanted)) {
    Result<std::unique_ptr<Device>> opened =
        Device::Open({.wanted = wanted, .thread_count = threads});
    if (opened.ok()) device = std::move(opened).value();
    status = opened.status();
  }
  setting.device = device.get();
  std::printf("device: %s, %u threads\n", device ? device->info().name.c_str() : "none (C++)",
              threads);
  if (status.ok() && timing) status = TimeSweep(setting);
  if (status.ok() && !pairs.empty()) status = RunPairs(pairs, !no_sgbm, setting);
  if (status.ok() && !street.empty()) status = RunStreet(street, keys, setting);
  if (status.ok()) return 0;
  std::fprintf(stderr, "veduta-bench-dense: %s\n", status.message().c_str());
  return 1;
}

}  // namespace
}  // namespace veduta

int main(int argc, char** argv) {
  return veduta::Run(argc, argv);
}
