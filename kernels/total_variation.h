// SPDX-License-Identifier: Apache-2.0
#pragma once
// Total variation with a histogram as data, on a sparse set of blocks of 16^3 voxels: minimises
//
//   E(u) = sum |grad u| + lambda sum_j n_j |u - c_j|     over u in [-1, 1]
//
// by the first-order primal-dual algorithm of Chambolle and Pock (JMIV 2011, algorithm 1, theta 1):
//
//   p <- project(p + sigma grad u_bar),   u' <- prox(u + tau div p),   u_bar <- 2 u' - u
//
// Only observed voxels take part, those with data. grad: forward differences between two of them, 0
// elsewhere (a natural boundary); div: minus its adjoint; project: onto |p| <= 1. prox is exact
// (Zach 2008; Li and Osher 2009: a median). With W_j the weight above bin j less that below,
//
//   prox(v) = clamp(min(v + tau lambda W_0, min_j max(c_j, v + tau lambda W_j)), -1, 1)
//
// An empty bin changes nothing in it, not even the last bit, and is skipped.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/total_variation_problem.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

class Device;

struct TvEnergy {
  double primal = 0;  // E(u)
  // Of p. The minimum of E is not below it (up to rounding), so primal - dual bounds how far E(u)
  // is from its minimum.
  double dual = 0;
};

// A minimisation under way. Every implementation computes the same bits: floats in a fixed order
// without contraction, energies summed in integers.
class TotalVariation {
 public:
  // From `u` [block_count x 4096], in [-1, 1]; voxels without data keep it. `p` [3 x block_count x
  // 4096], along x, y, z: empty for zeros, or what ReadDual gave before the data changed a little,
  // which saves iterations; Start makes it fit the new data. Where `device` is null, C++ computes
  // on `pool`, by the widest vectors that this processor has. The problem is copied.
  // kInvalidArgument naming what is wrong; kIoError if the device fails.
  static Result<std::unique_ptr<TotalVariation>> Start(const TvProblem& problem,
                                                       std::span<const float> u,
                                                       std::span<const float> p, Device* device,
                                                       ThreadPool& pool);
  virtual ~TotalVariation() = default;

  virtual Status Iterate(uint32_t count) = 0;
  virtual Result<TvEnergy> Energy() = 0;
  virtual Result<std::vector<float>> Read() = 0;      // u
  virtual Result<std::vector<float>> ReadDual() = 0;  // p
};

// On the device by kernels/total_variation.cl, one work item for each row of 16 voxels.
Result<std::unique_ptr<TotalVariation>> StartTotalVariationOn(Device& device,
                                                              const TvProblem& problem,
                                                              std::span<const float> u,
                                                              std::span<const float> p);

// The formula of prox above for one voxel, as plainly as possible: tests compare it with a search
// by brute force.
float HistogramProx(float v, float tau_lambda, std::span<const float> centers,
                    std::span<const float> weights);

}  // namespace veduta
