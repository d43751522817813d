// SPDX-License-Identifier: Apache-2.0
// What descriptor matching costs on one core: ms a pair, products a second, and the share of the
// processor's peak, which is measured first. Inputs are random bytes with the norm of root-SIFT;
// the time does not depend on them. Then what the essential matrices of five matches cost, beside
// OpenGV's solver.

#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <chrono>
#include <opengv/relative_pose/CentralRelativeAdapter.hpp>
#include <opengv/relative_pose/methods.hpp>
#include <string>

#include "engine/matching/five_point.h"
#include "engine/matching/guided_matcher.h"
#include "engine/matching/matcher_kernels.h"
#include "engine/matching/mutual_matcher.h"
#include "storage/base/content_hash.h"
#include "storage/base/cpu_isa.h"
#include "tools/bench/matching/multiply_peak.h"

namespace veduta {
namespace {

constexpr uint32_t kMutualCount = 1500;
constexpr uint32_t kGuidedCount = 4200;  // SIFT at 1536 x 1024
constexpr double kWidthPx = 1536, kHeightPx = 1024;

Features RandomFeatures(uint32_t count, bool one_sign, uint64_t seed) {
  SeededRandom random(seed);
  Features features;
  features.keypoints.resize(count);
  features.descriptors.resize(static_cast<size_t>(count) * kDescriptorSize);
  for (Keypoint& keypoint : features.keypoints) {
    keypoint.x_px = static_cast<float>(random.Unit() * kWidthPx);
    keypoint.y_px = static_cast<float>(random.Unit() * kHeightPx);
    keypoint.contrast_sign = one_sign || random.Below(2) != 0 ? 1 : -1;
  }
  for (uint8_t& byte : features.descriptors) byte = static_cast<uint8_t>(random.Below(78));
  return features;
}

// Products a second, in thousands of millions; the best of many short runs.
double MeasurePeak(CpuIsa isa) {
  if (isa == CpuIsa::kPortable) return 0;
  double best = 0;
  for (int run = 0; run < 30; ++run) {
    const auto start = std::chrono::steady_clock::now();
    const uint64_t products =
        isa == CpuIsa::kAvx2 ? MultiplyAvx2(200'000) : MultiplyAvx512Vnni(200'000);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    best = std::max(best, static_cast<double>(products) * 1e-9 / elapsed.count());
  }
  return best;
}

void MatchMutualPairs(benchmark::State& state, CpuIsa isa, bool one_sign) {
  const auto a = PackedDescriptors::Pack(RandomFeatures(kMutualCount, one_sign, 1), kMutualCount);
  const auto b = PackedDescriptors::Pack(RandomFeatures(kMutualCount, one_sign, 2), kMutualCount);
  const CpuIsaLimit limit(isa);
  double products = 0;
  for (int contrast = 0; contrast < kContrastClassCount; ++contrast) {
    products += 128.0 * a->span(contrast).count * b->span(contrast).count;
  }
  const double peak = MeasurePeak(isa);
  double fastest_s = 1e9;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(MatchMutual(*a, *b));
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    fastest_s = std::min(fastest_s, elapsed.count());
  }
  const double rate = products * 1e-9 / fastest_s;
  state.counters["ms_min"] = fastest_s * 1e3;
  state.counters["GMAC/s"] = rate;
  if (peak > 0) {
    state.counters["peak_GMAC/s"] = peak;
    state.counters["peak_share"] = rate / peak;
  }
}

void Pack(benchmark::State& state) {
  const Features features = RandomFeatures(kGuidedCount, false, 1);
  for (auto _ : state) benchmark::DoNotOptimize(PackedDescriptors::Pack(features, kMutualCount));
  state.counters["kB"] =
      static_cast<double>(PackedDescriptors::Pack(features, kMutualCount)->size_bytes()) / 1e3;
}

void BuildGrid(benchmark::State& state) {
  const Features features = RandomFeatures(kGuidedCount, false, 1);
  for (auto _ : state) benchmark::DoNotOptimize(FeatureGrid(features));
  state.counters["kB"] = static_cast<double>(FeatureGrid(features).size_bytes()) / 1e3;
}

// The fundamental matrix of cameras of 1200 px, a little turned, b's moved by `translation`.
Eigen::Matrix3d MovedCamera(const Eigen::Vector3d& translation) {
  Eigen::Matrix3d k;
  k << 1200, 0, kWidthPx / 2, 0, 1200, kHeightPx / 2, 0, 0, 1;
  Eigen::Matrix3d skew;
  skew << 0, -translation.z(), translation.y(), translation.z(), 0, -translation.x(),
      -translation.y(), translation.x(), 0;
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(0.15, Eigen::Vector3d(0.1, 1, 0.2).normalized()).toRotationMatrix();
  return k.inverse().transpose() * skew * turned * k.inverse();
}

void MatchGuidedPairs(benchmark::State& state, CpuIsa isa, const Eigen::Vector3d& translation) {
  const Features a = RandomFeatures(kGuidedCount, false, 1);
  const Features b = RandomFeatures(kGuidedCount, false, 2);
  const FeatureGrid grid(b);
  const Eigen::Matrix3d b_from_a = MovedCamera(translation);
  const CpuIsaLimit limit(isa);
  for (auto _ : state) benchmark::DoNotOptimize(MatchGuided(a, b, grid, b_from_a, {}));
}

void FindNearPoints(benchmark::State& state) {
  const Features a = RandomFeatures(kGuidedCount, false, 1);
  const Features b = RandomFeatures(kGuidedCount, false, 2);
  const FeatureGrid grid(b);
  GuidedScratch scratch;
  NearQuery query;
  query.radius_px = static_cast<double>(state.range(0));
  uint32_t i = 0;
  for (auto _ : state) {
    query.x_px = a.keypoints[i].x_px;
    query.y_px = a.keypoints[i].y_px;
    query.descriptor = a.descriptor(i);
    query.contrast_sign = a.keypoints[i].contrast_sign;
    benchmark::DoNotOptimize(FindNear(grid, b, query, &scratch));
    i = (i + 1) % kGuidedCount;
  }
}

// Rays of matches that agree with no motion: most samples that RANSAC draws are of that kind.
std::vector<Eigen::Vector3d> RandomRays(uint64_t seed) {
  SeededRandom random(seed);
  std::vector<Eigen::Vector3d> rays(500);
  for (Eigen::Vector3d& ray : rays)
    ray = Eigen::Vector3d(random.Unit() - 0.5, random.Unit() - 0.5, 1).normalized();
  return rays;
}

void SolveFivePoints(benchmark::State& state) {
  const std::vector<Eigen::Vector3d> a = RandomRays(1), b = RandomRays(2);
  SeededRandom random(3);
  std::array<Eigen::Vector3d, 5> of_a, of_b;
  for (auto _ : state) {
    for (size_t k = 0; k < 5; ++k) {
      const size_t match = random.Below(static_cast<uint32_t>(a.size()));
      of_a[k] = a[match], of_b[k] = b[match];
    }
    benchmark::DoNotOptimize(SolveFivePoint(of_a, of_b));
  }
}

void SolveFivePointsByOpenGv(benchmark::State& state) {
  const std::vector<Eigen::Vector3d> a = RandomRays(1), b = RandomRays(2);
  const opengv::bearingVectors_t rays_a(a.begin(), a.end()), rays_b(b.begin(), b.end());
  const opengv::relative_pose::CentralRelativeAdapter adapter(rays_b, rays_a);
  SeededRandom random(3);
  std::vector<int> sample(5);
  for (auto _ : state) {
    for (int& match : sample)
      match = static_cast<int>(random.Below(static_cast<uint32_t>(a.size())));
    benchmark::DoNotOptimize(opengv::relative_pose::fivept_stewenius(adapter, sample));
  }
}

void RegisterAll() {
  for (const CpuIsa isa : kCpuIsas) {
    if (FindMatcherKernels(isa) == nullptr) continue;
    const std::string name = CpuIsaName(isa);
    benchmark::RegisterBenchmark(("mutual_1500x1500_one_sign/" + name).c_str(), MatchMutualPairs,
                                 isa, true)
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(("mutual_1500x1500_two_signs/" + name).c_str(), MatchMutualPairs,
                                 isa, false)
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(("guided_4200x4200_sideways/" + name).c_str(), MatchGuidedPairs,
                                 isa, Eigen::Vector3d(-1, 0.1, 0.1))
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(("guided_4200x4200_forwards/" + name).c_str(), MatchGuidedPairs,
                                 isa, Eigen::Vector3d(0.1, 0.1, -1))
        ->Unit(benchmark::kMillisecond);
  }
  benchmark::RegisterBenchmark("five_point", SolveFivePoints)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("five_point_opengv", SolveFivePointsByOpenGv)
      ->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("pack_1500", Pack)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("grid_4200", BuildGrid)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("find_near_px", FindNearPoints)
      ->Arg(4)
      ->Arg(8)
      ->Arg(16)
      ->Unit(benchmark::kMicrosecond);
}

}  // namespace
}  // namespace veduta

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  veduta::RegisterAll();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
