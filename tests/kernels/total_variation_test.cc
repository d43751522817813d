// SPDX-License-Identifier: Apache-2.0
// Goal: the primal-dual steps are what their equations say; every instruction set and the
//   device give the same bits; the minimum is reached from any start.
// Method: the proximal step against brute force; the steps against plain loops over single
//   voxels with look-ups of neighbours, bit for bit, on seeded random histograms in blocks with
//   gaps; energies against their lower bound.
#include "kernels/total_variation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "kernels/device.h"
#include "kernels/total_variation_kernels.h"
#include "storage/base/content_hash.h"
#include "storage/base/cpu_isa.h"

namespace veduta {
namespace {

using Index = std::array<int, 3>;

// Seven blocks: a row of three, one above, one behind, one diagonal that touches nobody's face, one
// alone.
const std::vector<Index> kBlocks = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1, 0},
                                    {1, 0, 1}, {2, 1, 1}, {9, 9, 9}};

std::vector<int32_t> NeighborsOf(const std::vector<Index>& blocks) {
  std::vector<int32_t> neighbors;
  for (const Index& block : blocks) {
    for (int side = 0; side < 6; ++side) {
      Index next = block;
      next[side / 2] += side % 2 == 0 ? -1 : 1;
      const auto found = std::find(blocks.begin(), blocks.end(), next);
      neighbors.push_back(found == blocks.end() ? -1
                                                : static_cast<int32_t>(found - blocks.begin()));
    }
  }
  return neighbors;
}

// A third of the rows without data, the others with some bins of some voxels filled.
TvProblem RandomProblem(uint64_t seed) {
  SeededRandom random(seed);
  TvProblem problem;
  problem.block_count = static_cast<uint32_t>(kBlocks.size());
  problem.neighbors = NeighborsOf(kBlocks);
  problem.weights.assign(kBlocks.size() * kTvBins * kTvBlockVoxels, 0);
  problem.centers.assign(kBlocks.size() * kTvNearBins * kTvBlockVoxels, 0);
  problem.lambda = 0.06f;
  for (uint8_t& center : problem.centers) center = static_cast<uint8_t>(random.Below(256));
  for (size_t row = 0; row < kBlocks.size() * kTvRowsOfBlock; ++row) {
    if (random.Below(3) == 0) continue;
    for (uint32_t i = 0; i < kTvRow; ++i) {
      const size_t block = row / kTvRowsOfBlock, voxel = row % kTvRowsOfBlock * kTvRow + i;
      for (uint32_t n = random.Below(4); n > 0; --n) {
        const uint32_t bin = random.Below(kTvBins);
        problem.weights[(block * kTvBins + bin) * kTvBlockVoxels + voxel] =
            static_cast<uint16_t>(1 + random.Below(12));
      }
    }
  }
  problem.weights[5] = 65535;
  return problem;
}

std::vector<float> RandomStart(uint64_t seed) {
  SeededRandom random(seed);
  std::vector<float> u(kBlocks.size() * kTvBlockVoxels);
  for (float& value : u) value = static_cast<float>(2 * random.Unit() - 1);
  return u;
}

// Also where no difference is taken, and longer than 1: what does not fit is made to.
std::vector<float> RandomDual() {
  SeededRandom random(11);
  std::vector<float> p(3 * kBlocks.size() * kTvBlockVoxels);
  for (float& value : p) value = static_cast<float>(2 * random.Unit() - 1);
  return p;
}

// The algorithm as its header states it, voxel by voxel.
class PlainMinimisation {
 public:
  PlainMinimisation(const TvProblem& problem, const std::vector<float>& u)
      : problem_(problem), u_(u), u_bar_(u) {
    for (auto& p : p_) p.assign(u.size(), 0.f);
    for (size_t b = 0; b < kBlocks.size(); ++b) {
      for (int i = 0; i < 4096; ++i) {
        const Index at = {16 * kBlocks[b][0] + i % 16, 16 * kBlocks[b][1] + i / 16 % 16,
                          16 * kBlocks[b][2] + i / 256};
        number_[at] = b * 4096 + i;
        places_.push_back(at);
      }
    }
  }

  void Iterate() {
    for (size_t i = 0; i < u_.size(); ++i) {
      float p[3];
      for (int axis = 0; axis < 3; ++axis) {
        const auto next = Find(i, axis, 1);
        const bool is_edge = next >= 0 && IsObserved(i) && IsObserved(next);
        p[axis] = p_[axis][i] + kTvSigma * (is_edge ? u_bar_[next] - u_bar_[i] : 0.f);
      }
      const float scale = 1.f / std::max(std::sqrt((p[0] * p[0] + p[1] * p[1]) + p[2] * p[2]), 1.f);
      for (int axis = 0; axis < 3; ++axis) p_[axis][i] = p[axis] * scale;
    }
    for (size_t i = 0; i < u_.size(); ++i) {
      float d[3];
      for (int axis = 0; axis < 3; ++axis) {
        const auto before = Find(i, axis, -1);
        d[axis] = p_[axis][i] - (before < 0 ? 0.f : p_[axis][before]);
      }
      const float v = u_[i] + kTvTau * ((d[0] + d[1]) + d[2]);
      std::array<float, kTvBins> weights, centers;
      for (uint32_t bin = 0; bin < kTvBins; ++bin) {
        const size_t block = i / 4096, voxel = i % 4096;
        weights[bin] = problem_.weights[(block * kTvBins + bin) * 4096 + voxel];
        centers[bin] = bin == kTvNearBins
                           ? 1.f
                           : (-1.f + 2.f / 7.f * static_cast<float>(bin)) +
                                 static_cast<float>(
                                     problem_.centers[(block * kTvNearBins + bin) * 4096 + voxel]) *
                                     (2.f / (7.f * 256.f));
      }
      const float after = HistogramProx(v, kTvTau * problem_.lambda, centers, weights);
      u_bar_[i] = after + (after - u_[i]);
      u_[i] = after;
    }
  }
  const std::vector<float>& u() const { return u_; }

 private:
  bool IsObserved(size_t i) const {
    for (uint32_t bin = 0; bin < kTvBins; ++bin) {
      if (problem_.weights[(i / 4096 * kTvBins + bin) * 4096 + i % 4096] != 0) return true;
    }
    return false;
  }

  int64_t Find(size_t i, int axis, int step) const {
    Index at = places_[i];
    at[axis] += step;
    const auto found = number_.find(at);
    return found == number_.end() ? -1 : static_cast<int64_t>(found->second);
  }

  const TvProblem& problem_;
  std::vector<float> u_, u_bar_, p_[3];
  std::map<Index, size_t> number_;
  std::vector<Index> places_;
};

struct Trace {
  std::vector<float> u, p;
  std::vector<double> energies;
  bool operator==(const Trace&) const = default;
};
Trace RunOn(Result<std::unique_ptr<TotalVariation>> started, int steps) {
  Trace run;
  const std::unique_ptr<TotalVariation> minimisation = std::move(started).value();
  for (int i = 0; i < steps; ++i) {
    EXPECT_TRUE(minimisation->Iterate(3).ok());
    const TvEnergy energy = minimisation->Energy().value();
    run.energies.insert(run.energies.end(), {energy.primal, energy.dual});
  }
  run.u = minimisation->Read().value();
  run.p = minimisation->ReadDual().value();
  return run;
}

TEST(HistogramProx, MinimisesItsTerm) {
  SeededRandom random(7);
  for (int trial = 0; trial < 200; ++trial) {
    std::array<float, kTvBins> centers, weights;
    for (float& center : centers) center = static_cast<float>(2 * random.Unit() - 1);
    std::sort(centers.begin(), centers.end());
    for (float& weight : weights)
      weight = static_cast<float>(random.Below(3) == 0 ? random.Below(9) : 0);
    const double v = 4 * random.Unit() - 2, tau_lambda = 0.2 * random.Unit();
    const auto term = [&](double u) {
      double sum = 0.5 * (u - v) * (u - v);
      for (uint32_t j = 0; j < kTvBins; ++j)
        sum += tau_lambda * weights[j] * std::abs(u - centers[j]);
      return sum;
    };
    double best = -1;
    for (int i = -20000; i <= 20000; ++i) best = term(i / 20000.) < term(best) ? i / 20000. : best;
    const float found =
        HistogramProx(static_cast<float>(v), static_cast<float>(tau_lambda), centers, weights);
    EXPECT_NEAR(found, best, 1e-4) << "trial " << trial;
  }
}

// In C++, with the kernels that a processor with `isa` at best runs.
Result<std::unique_ptr<TotalVariation>> StartOnIsa(CpuIsa isa, const TvProblem& problem,
                                                   std::span<const float> u,
                                                   std::span<const float> p, ThreadPool& pool) {
  const CpuIsaLimit limit(isa);
  return TotalVariation::Start(problem, u, p, nullptr, pool);
}

TEST(TotalVariation, StepsAreTheirEquations) {
  const TvProblem problem = RandomProblem(1);
  const std::vector<float> start = RandomStart(2);
  PlainMinimisation plain(problem, start);
  for (int i = 0; i < 9; ++i) plain.Iterate();
  ThreadPool pool(0);
  EXPECT_EQ(RunOn(StartOnIsa(CpuIsa::kPortable, problem, start, {}, pool), 3).u, plain.u());
}

TEST(TotalVariation, EveryIsaGivesTheSameBits) {
  const TvProblem problem = RandomProblem(3);
  const std::vector<float> start = RandomStart(4);
  ThreadPool none(0), some(3);
  const Trace portable =
      RunOn(StartOnIsa(CpuIsa::kPortable, problem, start, RandomDual(), none), 20);
  for (const CpuIsa isa : kCpuIsas) {
    EXPECT_EQ(RunOn(StartOnIsa(isa, problem, start, RandomDual(), none), 20), portable)
        << CpuIsaName(isa);
    EXPECT_EQ(RunOn(StartOnIsa(isa, problem, start, RandomDual(), some), 20), portable)
        << CpuIsaName(isa);
  }
}

TEST(TotalVariation, TheDeviceGivesTheSameBits) {
  if (ListDevices().empty()) GTEST_SKIP() << "no OpenCL device";
  const std::unique_ptr<Device> device = Device::Open({}).value();
  const TvProblem problem = RandomProblem(5);
  const std::vector<float> start = RandomStart(6);
  ThreadPool pool(0);
  const Trace reference =
      RunOn(StartOnIsa(CpuIsa::kPortable, problem, start, RandomDual(), pool), 20);
  const Trace run = RunOn(StartTotalVariationOn(*device, problem, start, RandomDual()), 20);
  EXPECT_EQ(run.u, reference.u);
  EXPECT_EQ(run.p, reference.p);
  EXPECT_EQ(run.energies, reference.energies);
}

TEST(TotalVariation, ReachesTheMinimumFromAnyStart) {
  const TvProblem problem = RandomProblem(8);
  ThreadPool pool(1);
  const std::vector<float> zero(kBlocks.size() * kTvBlockVoxels, 0.f);
  for (const std::vector<float>& start : {zero, RandomStart(9)}) {
    const auto minimisation = TotalVariation::Start(problem, start, {}, nullptr, pool).value();
    ASSERT_TRUE(minimisation->Iterate(1000).ok());
    const TvEnergy energy = minimisation->Energy().value();
    EXPECT_LE(energy.dual, energy.primal);
    EXPECT_GT(energy.dual, energy.primal * 0.999);
  }
}

TEST(TotalVariation, GoesOnWhereItWas) {
  const TvProblem problem = RandomProblem(12);
  ThreadPool pool(1);
  const auto first = TotalVariation::Start(problem, RandomStart(13), {}, nullptr, pool).value();
  ASSERT_TRUE(first->Iterate(300).ok());
  const std::vector<float> u = first->Read().value(), p = first->ReadDual().value();
  const double gap = first->Energy()->primal - first->Energy()->dual;
  const auto warm = TotalVariation::Start(problem, u, p, nullptr, pool).value();
  const auto cold = TotalVariation::Start(problem, u, {}, nullptr, pool).value();
  EXPECT_LT(warm->Energy()->primal - warm->Energy()->dual, 1.01 * gap);
  EXPECT_GT(cold->Energy()->primal - cold->Energy()->dual, 10 * gap);
}

TEST(TotalVariation, RefusesWhatDoesNotFit) {
  ThreadPool pool(0);
  TvProblem problem = RandomProblem(1);
  const std::vector<float> start = RandomStart(2);
  const auto code = [&](const TvProblem& p, std::span<const float> u) {
    return TotalVariation::Start(p, u, {}, nullptr, pool).status().code();
  };
  EXPECT_EQ(code(problem, std::span(start).first(4096)), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(problem, std::vector<float>(start.size(), 1.5f)), StatusCode::kInvalidArgument);
  problem.neighbors[1] = 2;  // block 2 does not think so
  EXPECT_EQ(code(problem, start), StatusCode::kInvalidArgument);
  problem.neighbors[1] = 77;
  EXPECT_EQ(code(problem, start), StatusCode::kInvalidArgument);
  problem = RandomProblem(1);
  problem.lambda = 0;
  EXPECT_EQ(code(problem, start), StatusCode::kInvalidArgument);
  TvProblem empty;
  empty.lambda = 1;
  EXPECT_TRUE(TotalVariation::Start(empty, {}, {}, nullptr, pool).ok());
}

}  // namespace
}  // namespace veduta
