// SPDX-License-Identifier: Apache-2.0
#pragma once
// The reduced camera system of a bundle adjustment: 6x6 blocks where two free images share a point.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "engine/mapping/bundle_problem.h"

namespace veduta {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Which blocks of the lower triangle there are: row after row, each in ascending columns up to the
// diagonal. Immutable.
class BlockPattern final {
 public:
  // O(sum of squared track lengths).
  explicit BlockPattern(const BundleProblem& problem);

  uint32_t row_count() const { return static_cast<uint32_t>(row_begin_.size() - 1); }
  size_t block_count() const { return columns_.size(); }
  size_t RowBegin(uint32_t row) const { return row_begin_[row]; }
  size_t Diagonal(uint32_t row) const { return row_begin_[row + 1] - 1; }
  uint32_t Column(size_t block) const { return columns_[block]; }
  // The block of a column in a row. The search starts at block `from`; the block must exist.
  size_t Find(uint32_t row, size_t from, uint32_t column) const;

 private:
  std::vector<size_t> row_begin_;  // [rows + 1]
  std::vector<uint32_t> columns_;  // of each block
};

// The whole system, or the part of it that some of the points add.
struct CameraSystem {
  std::vector<Matrix6d> blocks;  // in the pattern's order; diagonal blocks are kept whole
  // [6 rows]: what the eliminated points leave on the right-hand side.
  Eigen::VectorXd right;
  // [6 rows]: derivative of the cost by the poses.
  Eigen::VectorXd gradient;
  // [6 rows]: diagonal of the poses' normal equations, before points are eliminated.
  Eigen::VectorXd diagonal;

  void SetZero(const BlockPattern& pattern);
  void Add(const CameraSystem& other);
};

// Solves systems of one pattern, one after another: densely by Eigen, or sparsely by CHOLMOD, which
// seeks the order of elimination once. What was solved before does not change an answer.
class SystemSolver final {
 public:
  // The pattern must outlive it.
  SystemSolver(const BlockPattern& pattern, bool is_dense);
  ~SystemSolver();

  // The poses' tangents that solve the system with its diagonal damped by `lambda`. Nothing if the
  // system is not positive definite. Never prints.
  std::optional<Eigen::VectorXd> Solve(const CameraSystem& system, double lambda);
  // The same for other right-hand sides, one for each column.
  std::optional<Eigen::MatrixXd> Solve(const CameraSystem& system, double lambda,
                                       const Eigen::MatrixXd& right);

 private:
  struct SparseFactor;

  template <typename Right>
  std::optional<Right> SolveFor(const CameraSystem& system, double lambda, const Right& right);

  const BlockPattern& pattern_;
  std::unique_ptr<SparseFactor> sparse_;  // null where it solves densely
};

}  // namespace veduta
