// SPDX-License-Identifier: Apache-2.0
#pragma once
// The least-squares problem of a relaxation (submap_relaxation.h) and its solver.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/mapping/relaxation_problem.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// What is estimated.
struct RelaxationEstimate {
  std::vector<Sim3> new_from_old;        // one for each submap
  std::vector<Eigen::Vector3d> centers;  // about which the submaps turn, where they are now
  std::vector<Eigen::Vector3d> places;   // one for each tie
};

// Moves submaps and places to where the views' squared errors, weighted by a Cauchy loss, are
// least. The first submap stays where the start has it. Deterministic at any number of threads. Not
// thread-safe.
class SubmapRelaxer final {
 public:
  // The problem and the pool must outlive this.
  SubmapRelaxer(const RelaxationProblem& problem, RelaxationEstimate start, ThreadPool* pool);
  ~SubmapRelaxer();

  // Levenberg-Marquardt at one scale of the loss, in px. Where `moves` is false only the places
  // move. O(views) and, with submaps that touch a bounded number of others, O(submaps) for each
  // step.
  void Minimise(double scale_px, uint32_t iterations_max, bool moves);

  // Half the sum of rho(squared error in px). O(views).
  double CostAt(double scale_px) const;
  // The error of each view. O(views).
  std::vector<Eigen::Vector2d> Errors() const;

  const RelaxationEstimate& estimate() const { return estimate_; }

 private:
  class Equations;

  RelaxationEstimate estimate_;
  std::unique_ptr<Equations> equations_;
};

}  // namespace veduta
