// SPDX-License-Identifier: Apache-2.0
#include "kernels/total_variation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "kernels/total_variation_kernels.h"
#include "kernels/total_variation_rows.h"
#include "storage/base/cpu_isa.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr size_t kPadding =
    kTvRow;  // floats before and behind the voxels: rows are read shifted by one

CpuVariants<TvKernels> Variants() {
  return {.portable = kTvKernelsPortable, .avx2 = kTvKernelsAvx2, .avx512 = kTvKernelsAvx512};
}

class CppTotalVariation final : public TotalVariation {
 public:
  CppTotalVariation(const TvProblem& problem, std::span<const float> u, std::span<const float> p,
                    ThreadPool& pool)
      : problem_(problem),
        bits_of_row_(BitsOfRows(problem)),
        kernels_(Variants().Best()),
        pool_(pool) {
    for (auto* array : {&u_, &u_bar_}) {
      array->assign(u.size() + 2 * kPadding, 0.f);
      std::copy(u.begin(), u.end(), array->begin() + kPadding);
    }
    for (auto& array : p_) array.assign(u.size() + 2 * kPadding, 0.f);
    arrays_ = {u_.data() + kPadding,
               u_bar_.data() + kPadding,
               {p_[0].data() + kPadding, p_[1].data() + kPadding, p_[2].data() + kPadding},
               problem_.neighbors.data(),
               problem_.weights.data(),
               problem_.centers.data(),
               bits_of_row_.data(),
               problem_.lambda};
    if (p.empty()) return;
    const std::vector<float> fitted = FitDual(problem_, bits_of_row_, p);
    for (size_t axis = 0; axis < 3; ++axis) {
      std::copy_n(fitted.begin() + static_cast<std::ptrdiff_t>(axis * u.size()), u.size(),
                  p_[axis].begin() + kPadding);
    }
  }

  Status Iterate(uint32_t count) override {
    for (uint32_t i = 0; i < count; ++i) {
      pool_.ParallelFor(problem_.block_count,
                        [&](size_t b) { kernels_.dual(arrays_, static_cast<uint32_t>(b)); });
      pool_.ParallelFor(problem_.block_count,
                        [&](size_t b) { kernels_.primal(arrays_, static_cast<uint32_t>(b)); });
    }
    return Status::Ok();
  }

  Result<TvEnergy> Energy() override {
    std::vector<TvBlockEnergy> energies(problem_.block_count);
    pool_.ParallelFor(problem_.block_count, [&](size_t b) {
      energies[b] = kernels_.energy(arrays_, static_cast<uint32_t>(b));
    });
    TvBlockEnergy sum;
    for (const TvBlockEnergy& energy : energies) {
      sum.primal += energy.primal;
      sum.dual += energy.dual;
    }
    return TvEnergy{static_cast<double>(sum.primal) / kTvEnergyOne,
                    static_cast<double>(sum.dual) / kTvEnergyOne};
  }

  Result<std::vector<float>> Read() override {
    return std::vector<float>(u_.begin() + kPadding, u_.end() - kPadding);
  }

  Result<std::vector<float>> ReadDual() override {
    std::vector<float> p;
    for (const auto& along : p_)
      p.insert(p.end(), along.begin() + kPadding, along.end() - kPadding);
    return p;
  }

 private:
  const TvProblem problem_;
  const std::vector<uint32_t> bits_of_row_;
  const TvKernels& kernels_;
  ThreadPool& pool_;
  std::vector<float> u_, u_bar_, p_[3];
  TvArrays arrays_{};
};

Status CheckStart(const TvProblem& problem, std::span<const float> u, std::span<const float> p) {
  VEDUTA_RETURN_IF_ERROR(problem.Check());
  if (u.size() != static_cast<size_t>(problem.block_count) * kTvBlockVoxels) {
    return Status::InvalidArgument("the start has " + std::to_string(u.size()) +
                                   " voxels, the problem " + std::to_string(problem.block_count) +
                                   " blocks");
  }
  if (!p.empty() && (p.size() != 3 * u.size() || !std::all_of(p.begin(), p.end(), [](float value) {
                       return std::abs(value) <= 2;
                     }))) {
    return Status::InvalidArgument(
        "the start's dual variables do not fit its voxels or are beyond 2");
  }
  if (!std::all_of(u.begin(), u.end(), [](float value) { return value >= -1 && value <= 1; })) {
    return Status::InvalidArgument("the start has a value outside of [-1, 1]");
  }
  return Status::Ok();
}

}  // namespace

std::vector<uint32_t> BitsOfRows(const TvProblem& problem) {
  std::vector<uint32_t> bits(static_cast<size_t>(problem.block_count) * kTvRowsOfBlock, 0);
  for (size_t block = 0; block < problem.block_count; ++block) {
    for (uint32_t bin = 0; bin < kTvBins; ++bin) {
      const uint16_t* weights = problem.weights.data() + (block * kTvBins + bin) * kTvBlockVoxels;
      for (uint32_t i = 0; i < kTvBlockVoxels; ++i) {
        if (weights[i] != 0)
          bits[block * kTvRowsOfBlock + i / kTvRow] |= 1u << bin | 1u << (16 + i % kTvRow);
      }
    }
  }
  return bits;
}

std::vector<float> FitDual(const TvProblem& problem, const std::vector<uint32_t>& bits,
                           std::span<const float> p) {
  const size_t voxels = static_cast<size_t>(problem.block_count) * kTvBlockVoxels;
  constexpr std::array<size_t, 3> steps = {1, kTvRow, static_cast<size_t>(kTvRow) * kTvRow};
  const auto is_observed = [&](size_t voxel) {
    return (bits[voxel / kTvRow] >> (16 + voxel % kTvRow) & 1) != 0;
  };
  std::vector<float> fitted(3 * voxels, 0.f);
  for (size_t voxel = 0; voxel < voxels; ++voxel) {
    if (!is_observed(voxel)) continue;
    std::array<float, 3> here{};
    for (size_t axis = 0; axis < 3; ++axis) {
      size_t next = voxel + steps[axis];
      if (voxel / steps[axis] % kTvRow == kTvRow - 1) {
        const int32_t block = problem.neighbors[6 * (voxel / kTvBlockVoxels) + 2 * axis + 1];
        if (block < 0) continue;
        next = static_cast<size_t>(block) * kTvBlockVoxels + voxel % kTvBlockVoxels -
               (kTvRow - 1) * steps[axis];
      }
      if (is_observed(next)) here[axis] = p[axis * voxels + voxel];
    }
    const float norm = std::sqrt((here[0] * here[0] + here[1] * here[1]) + here[2] * here[2]);
    for (size_t axis = 0; axis < 3; ++axis)
      fitted[axis * voxels + voxel] = here[axis] / std::max(norm, 1.f);
  }
  return fitted;
}

Status TvProblem::Check() const {
  const size_t voxels = static_cast<size_t>(block_count) * kTvBlockVoxels;
  if (neighbors.size() != 6 * static_cast<size_t>(block_count) ||
      weights.size() != kTvBins * voxels || centers.size() != kTvNearBins * voxels) {
    return Status::InvalidArgument("neighbours, weights or centres do not fit " +
                                   std::to_string(block_count) + " blocks");
  }
  VEDUTA_RETURN_IF_ERROR(OptionBounds().FiniteAbove("lambda", lambda, 0).status());
  for (size_t i = 0; i < neighbors.size(); ++i) {
    const int32_t other = neighbors[i];
    if (other < -1 || other >= static_cast<int32_t>(block_count) ||
        (other >= 0 &&
         neighbors[6 * static_cast<size_t>(other) + (i % 6 ^ 1)] != static_cast<int32_t>(i / 6))) {
      return Status::InvalidArgument("block " + std::to_string(i / 6) + " and its neighbour " +
                                     std::to_string(other) + " do not name each other");
    }
  }
  return Status::Ok();
}

Result<std::unique_ptr<TotalVariation>> TotalVariation::Start(const TvProblem& problem,
                                                              std::span<const float> u,
                                                              std::span<const float> p,
                                                              Device* device, ThreadPool& pool) {
  VEDUTA_RETURN_IF_ERROR(CheckStart(problem, u, p));
  if (device) return StartTotalVariationOn(*device, problem, u, p);
  return std::unique_ptr<TotalVariation>(std::make_unique<CppTotalVariation>(problem, u, p, pool));
}

float HistogramProx(float v, float tau_lambda, std::span<const float> centers,
                    std::span<const float> weights) {
  float above = 0;
  for (const float weight : weights) above += weight;
  float u = v + tau_lambda * above;
  for (size_t j = 0; j < centers.size(); ++j) {
    above -= 2.f * weights[j];
    u = std::min(u, std::max(centers[j], v + tau_lambda * above));
  }
  return std::max(std::min(u, 1.f), -1.f);
}

}  // namespace veduta
