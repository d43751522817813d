// SPDX-License-Identifier: Apache-2.0
// Goal: the reduced camera system is solved the same densely and sparsely; a matrix that is not
//   positive definite gives no solution and prints nothing, for standard output holds results.
// Method: a small system of known solution; file descriptor 1 is caught in a file while CHOLMOD
//   meets a matrix that is not positive definite.
#include "engine/mapping/camera_system.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>

namespace veduta {
namespace {

// Free images that all see one point: every block of the lower triangle is there.
BlockPattern Pattern(uint32_t image_count = 3) {
  BundleProblem problem;
  problem.free_count = image_count;
  problem.points = {{0, 0, 1}};
  problem.first_observation = {0, image_count};
  for (uint32_t image = 0; image < image_count; ++image)
    problem.observations.push_back({image, {0, 0}});
  return BlockPattern(problem);
}

CameraSystem System(const BlockPattern& pattern, double diagonal) {
  CameraSystem system;
  system.SetZero(pattern);
  for (uint32_t row = 0; row < pattern.row_count(); ++row) {
    for (size_t block = pattern.RowBegin(row); block <= pattern.Diagonal(row); ++block)
      system.blocks[block].setConstant(0.1);
    system.blocks[pattern.Diagonal(row)].diagonal().array() += diagonal;
  }
  system.diagonal.setConstant(1);
  for (Eigen::Index i = 0; i < system.right.size(); ++i) system.right[i] = static_cast<double>(i);
  return system;
}

// What `work` writes to file descriptor 1.
template <typename Work>
std::string CaughtOutput(const Work& work) {
  std::fflush(stdout);
  std::FILE* const file = std::tmpfile();
  const int kept = dup(1);
  dup2(fileno(file), 1);
  work();
  std::fflush(stdout);
  dup2(kept, 1);
  close(kept);
  std::string text(static_cast<size_t>(lseek(fileno(file), 0, SEEK_END)), ' ');
  lseek(fileno(file), 0, SEEK_SET);
  EXPECT_EQ(read(fileno(file), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  std::fclose(file);
  return text;
}

TEST(CameraSystem, ThePatternIsTheLowerTriangle) {
  const BlockPattern pattern = Pattern();
  ASSERT_EQ(pattern.row_count(), 3u);
  ASSERT_EQ(pattern.block_count(), 6u);
  for (uint32_t row = 0; row < 3; ++row) {
    for (uint32_t column = 0; column <= row; ++column) {
      const size_t block = pattern.Find(row, pattern.RowBegin(row), column);
      EXPECT_EQ(pattern.Column(block), column);
    }
    EXPECT_EQ(pattern.Column(pattern.Diagonal(row)), row);
  }
}

TEST(CameraSystem, DenseAndSparseAgree) {
  const BlockPattern pattern = Pattern();
  const CameraSystem system = System(pattern, 2);
  const auto dense = SystemSolver(pattern, true).Solve(system, 0.5),
             sparse = SystemSolver(pattern, false).Solve(system, 0.5);
  ASSERT_TRUE(dense && sparse);
  EXPECT_LT((*dense - *sparse).norm(), 1e-12);
  // (0.1 ones + 2.5 I) x = right
  const Eigen::VectorXd back =
      2.5 * *dense + Eigen::VectorXd::Constant(dense->size(), 0.1 * dense->sum());
  EXPECT_LT((back - system.right).norm(), 1e-12);
}

TEST(CameraSystem, WhatWasSolvedBeforeChangesNothing) {
  const BlockPattern pattern = Pattern(20);
  for (const bool is_dense : {false, true}) {
    SystemSolver solver(pattern, is_dense);
    for (const double diagonal : {2.0, -5.0, 3.0, 2.5}) {  // -5: not positive definite
      const CameraSystem system = System(pattern, diagonal);
      const auto solved = solver.Solve(system, 0.5);
      const auto alone = SystemSolver(pattern, is_dense).Solve(system, 0.5);
      ASSERT_EQ(solved.has_value(), diagonal > 0);
      ASSERT_EQ(alone.has_value(), diagonal > 0);
      if (solved) {
        EXPECT_TRUE(*solved == *alone) << diagonal;
      }
    }
  }
}

TEST(CameraSystem, PiecesAddUp) {
  const BlockPattern pattern = Pattern();
  CameraSystem sum = System(pattern, 2);
  sum.Add(System(pattern, 3));
  EXPECT_NEAR(sum.blocks[pattern.Diagonal(1)](0, 0), 5.2, 1e-12);
  EXPECT_EQ(sum.right[7], 14);
  sum.SetZero(pattern);
  EXPECT_EQ(sum.right.norm(), 0);
}

TEST(CameraSystem, AMatrixThatIsNotPositiveDefiniteIsRefusedInSilence) {
  // 120 rows are enough for CHOLMOD to factor by supernodes, which is where it complains.
  const BlockPattern pattern = Pattern(20);
  const CameraSystem system = System(pattern, -5);
  EXPECT_EQ(CaughtOutput([] { std::printf("heard"); }), "heard") << "the test hears nothing";
  for (const bool is_dense : {false, true}) {
    bool is_solved = true;
    EXPECT_EQ(CaughtOutput([&] {
                is_solved = SystemSolver(pattern, is_dense).Solve(system, 0).has_value();
              }),
              "");
    EXPECT_FALSE(is_solved);
  }
}

}  // namespace
}  // namespace veduta
