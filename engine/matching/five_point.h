// SPDX-License-Identifier: Apache-2.0
#pragma once
// The essential matrices of five matches (Nister, "An efficient solution to the five-point relative
// pose problem", PAMI 2004).

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

namespace veduta {

// At most ten; deterministic.
struct EssentialMatrices {
  std::array<Eigen::Matrix3d, 10> matrices;  // b_essential_a, of norm 1
  size_t count = 0;

  std::span<const Eigen::Matrix3d> all() const& { return {matrices.data(), count}; }
  void all() const&& = delete;  // `for (x : F().all())` would dangle
};

// All E with b[i]^T E a[i] = 0 for five rays, of any length > 0, in the two cameras' frames, but
// for solutions that nearly coincide with another one. Near a sample that leaves more than it fixes
// they are less exact, to a few thousandths; at one there are none, or they mean nothing.
// Thread-safe. 8.5 us where OpenGV's solver takes 21.6 (veduta-bench-matching), which was much of
// what verifying a pair cost.
EssentialMatrices SolveFivePoint(const std::array<Eigen::Vector3d, 5>& a,
                                 const std::array<Eigen::Vector3d, 5>& b);

// The roots within [-1, 1] of the polynomial sum_k coefficients[k] t^k of degree at most 10,
// ascending, each between two places where its sign differs: a double root may be missed. Returns
// how many there are.
size_t FindRootsInUnit(std::span<const double> coefficients, std::array<double, 10>* roots);

}  // namespace veduta
