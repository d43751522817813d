// SPDX-License-Identifier: Apache-2.0
#include "kernels/total_variation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "kernels/total_variation_kernels.h"
#include "kernels/total_variation_rows.h"
#include "storage/base/cpu_isa.h"

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
