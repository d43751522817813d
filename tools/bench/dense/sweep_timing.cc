// SPDX-License-Identifier: Apache-2.0
// Time of one view triple, beside what the machine can do at best.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>

#include "kernels/scanline.h"
#include "storage/base/content_hash.h"
#include "tools/bench/dense/depth_benchmark.h"

namespace veduta {
namespace {

constexpr uint32_t kWidth = 512, kHeight = 384, kPlanes = 200, kRuns = 7;

struct Spent {
  double wall_s = 1e9,
         cpu_s = 1e9;  // the second over all threads: what the machine's other work hardly changes
};

// Keeps the least of either.
void Run(const std::function<void()>& work, Spent* least) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  work();
  const double wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  least->wall_s = std::min(least->wall_s, wall_s);
  least->cpu_s =
      std::min(least->cpu_s, static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC);
}

std::vector<uint8_t> RandomImage(uint64_t seed) {
  SeededRandom random(seed);
  std::vector<uint8_t> pixels(kWidth * kHeight);
  for (uint8_t& pixel : pixels) pixel = static_cast<uint8_t>(random.Below(256));
  return pixels;
}

// The fastest of a few runs, and after each a copy of memory, so that both meet the same neighbours
// on the machine.
Status Measure(const SweepProblem& problem, const ScanlineOptions& options, Device* device,
               ThreadPool& pool) {
  Spent sweep, copy;
  std::vector<uint8_t> from(256u << 20, 1), to(256u << 20, 2);
  for (uint32_t run = 0; run < kRuns; ++run) {
    Status status;
    Run([&] { status = SweepAndChoose(problem, options, device, pool).status(); }, &sweep);
    VEDUTA_RETURN_IF_ERROR(status);
    Run(
        [&] {
          pool.ParallelFor(
              16, [&](size_t i) { std::copy_n(&from[i << 24], size_t{1} << 24, &to[i << 24]); });
        },
        &copy);
  }
  // A cost: written once, read in eight directions; its sum: written by the first, read and written
  // by seven, read once.
  const double cells = static_cast<double>(kWidth) * kHeight * PlaneStride(kPlanes);
  const double bytes = cells * (1 + 8 + 2 * (1 + 14 + 1));
  const double bandwidth = 2.0 * static_cast<double>(from.size()) / copy.wall_s;
  // In 16 lanes: a comparison of the window is 35 pairs of loads, comparisons, an exclusive or and
  // a subtraction, a gradient about 30 more, for each of two views; a step of a scanline about 18 a
  // direction; no warp counted.
  const double operations = cells / 16 * (2 * (35 * 6 + 30) + 8 * 18);
  std::printf("%s: %.0f ms, and %.0f ms of processor time\n",
              device ? device->info().name.c_str() : "C++", 1e3 * sweep.wall_s, 1e3 * sweep.cpu_s);
  std::printf(
      "  moves %.2f GB: %.0f ms at the %.1f GB/s of a copy now; %.2f G operations of 16 lanes: "
      "%.2f G/s of a core\n",
      bytes / 1e9, 1e3 * bytes / bandwidth, bandwidth / 1e9, operations / 1e9,
      operations / sweep.cpu_s / 1e9);
  return Status::Ok();
}

}  // namespace

Status TimeSweep(const BenchmarkSetting& setting) {
  const std::vector<uint8_t> images[] = {RandomImage(1), RandomImage(2), RandomImage(3)};
  SweepProblem problem;
  problem.key = {kWidth, kHeight, images[0].data()};
  for (const int side : {-1, 1}) {
    SweepSensor sensor;
    sensor.image = {kWidth, kHeight, images[side < 0 ? 1 : 2].data()};
    sensor.rotation = {1, 0.01f, 0, -0.01f, 1, 0, 1e-5f, 0, 1};
    sensor.translation = {static_cast<float>(side), 0, 0};
    problem.sensors.push_back(sensor);
  }
  for (uint32_t k = 0; k < kPlanes; ++k) problem.planes.push_back({0, 0, static_cast<float>(k)});
  ScanlineOptions options;
  options.penalty_large.fill(100);
  std::printf("%ux%u, two sensor views, %u planes, eight directions; the fastest of %u runs\n",
              kWidth, kHeight, kPlanes, kRuns);
  if (setting.device != nullptr)
    VEDUTA_RETURN_IF_ERROR(Measure(problem, options, setting.device, *setting.pool));
  return Measure(problem, options, nullptr, *setting.pool);
}

}  // namespace veduta
