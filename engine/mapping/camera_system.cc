// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/camera_system.h"

#include <Eigen/Cholesky>
#include <Eigen/CholmodSupport>
#include <Eigen/SparseCore>
#include <algorithm>

namespace veduta {
namespace {

Eigen::Index At(uint32_t image) {
  return 6 * static_cast<Eigen::Index>(image);
}

Eigen::MatrixXd DenseLower(const BlockPattern& pattern, const CameraSystem& system) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(At(pattern.row_count()), At(pattern.row_count()));
  for (uint32_t row = 0; row < pattern.row_count(); ++row) {
    for (size_t block = pattern.RowBegin(row); block <= pattern.Diagonal(row); ++block) {
      matrix.block<6, 6>(At(row), At(pattern.Column(block))) = system.blocks[block];
    }
  }
  return matrix;
}

// The upper triangle, which CHOLMOD wants column by column: the rows of the lower triangle are the
// columns of the upper one.
Eigen::SparseMatrix<double> SparseUpper(const BlockPattern& pattern, const CameraSystem& system) {
  Eigen::SparseMatrix<double> matrix(At(pattern.row_count()), At(pattern.row_count()));
  matrix.reserve(static_cast<Eigen::Index>(36 * pattern.block_count()));
  for (uint32_t row = 0; row < pattern.row_count(); ++row) {
    for (int i = 0; i < 6; ++i) {
      matrix.startVec(At(row) + i);
      for (size_t block = pattern.RowBegin(row); block <= pattern.Diagonal(row); ++block) {
        const int count = block == pattern.Diagonal(row) ? i + 1 : 6;
        for (int j = 0; j < count; ++j) {
          matrix.insertBack(At(pattern.Column(block)) + j, At(row) + i) =
              system.blocks[block](i, j);
        }
      }
    }
  }
  matrix.finalize();
  return matrix;
}

template <typename Factor, typename Right>
std::optional<Right> SolveBy(const Factor& factor, const Right& right) {
  if (factor.info() != Eigen::Success) return std::nullopt;
  Right solution = factor.solve(right);
  return solution.allFinite() ? std::optional(std::move(solution)) : std::nullopt;
}

}  // namespace

BlockPattern::BlockPattern(const BundleProblem& problem) {
  std::vector<std::vector<uint32_t>> points_of(problem.free_count);
  for (uint32_t point = 0; point < problem.points.size(); ++point) {
    for (uint32_t o = problem.first_observation[point]; o < problem.first_observation[point + 1];
         ++o) {
      const uint32_t image = problem.observations[o].image;
      if (image < problem.free_count) points_of[image].push_back(point);
    }
  }
  std::vector<uint32_t> last_row(problem.free_count, problem.free_count);
  row_begin_.push_back(0);
  for (uint32_t row = 0; row < problem.free_count; ++row) {
    for (const uint32_t point : points_of[row]) {
      for (uint32_t o = problem.first_observation[point]; o < problem.first_observation[point + 1];
           ++o) {
        const uint32_t image = problem.observations[o].image;
        if (image > row || last_row[image] == row) continue;
        last_row[image] = row;
        columns_.push_back(image);
      }
    }
    std::sort(columns_.begin() + static_cast<ptrdiff_t>(row_begin_.back()), columns_.end());
    row_begin_.push_back(columns_.size());
  }
}

size_t BlockPattern::Find(uint32_t row, size_t from, uint32_t column) const {
  const auto begin = columns_.begin();
  return static_cast<size_t>(std::lower_bound(begin + static_cast<ptrdiff_t>(from),
                                              begin + static_cast<ptrdiff_t>(row_begin_[row + 1]),
                                              column) -
                             begin);
}

void CameraSystem::SetZero(const BlockPattern& pattern) {
  blocks.assign(pattern.block_count(), Matrix6d::Zero());
  right.setZero(At(pattern.row_count()));
  gradient.setZero(At(pattern.row_count()));
  diagonal.setZero(At(pattern.row_count()));
}

void CameraSystem::Add(const CameraSystem& other) {
  for (size_t i = 0; i < blocks.size(); ++i) blocks[i] += other.blocks[i];
  right += other.right;
  gradient += other.gradient;
  diagonal += other.diagonal;
}

struct SystemSolver::SparseFactor {
  Eigen::CholmodDecomposition<Eigen::SparseMatrix<double>, Eigen::Upper> factor;
  bool has_order = false;
};

SystemSolver::SystemSolver(const BlockPattern& pattern, bool is_dense) : pattern_(pattern) {
  if (is_dense) return;
  sparse_ = std::make_unique<SparseFactor>();
  // CHOLMOD says on standard output, where results go, that a matrix is not positive definite. A
  // level of 0 keeps it silent; the caller learns of it from the answer.
  sparse_->factor.cholmod().print = 0;
}

SystemSolver::~SystemSolver() = default;

template <typename Right>
std::optional<Right> SystemSolver::SolveFor(const CameraSystem& system, double lambda,
                                            const Right& right) {
  if (sparse_ == nullptr) {
    Eigen::MatrixXd matrix = DenseLower(pattern_, system);
    matrix.diagonal() += lambda * system.diagonal;
    return SolveBy(Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(matrix), right);
  }
  Eigen::SparseMatrix<double> matrix = SparseUpper(pattern_, system);
  matrix.diagonal() += lambda * system.diagonal;
  if (!sparse_->has_order) sparse_->factor.analyzePattern(matrix);
  sparse_->has_order = true;
  sparse_->factor.factorize(matrix);
  return SolveBy(sparse_->factor, right);
}

std::optional<Eigen::VectorXd> SystemSolver::Solve(const CameraSystem& system, double lambda) {
  const Eigen::VectorXd right = system.right - system.gradient;
  return SolveFor(system, lambda, right);
}

std::optional<Eigen::MatrixXd> SystemSolver::Solve(const CameraSystem& system, double lambda,
                                                   const Eigen::MatrixXd& right) {
  return SolveFor(system, lambda, right);
}

}  // namespace veduta
