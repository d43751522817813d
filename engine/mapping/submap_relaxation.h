// SPDX-License-Identifier: Apache-2.0
#pragma once
// Spreads strain between submaps over all of them: each is moved as a whole, by a similarity, to
// where the places that several of them see project best. It is a bundle adjustment over the
// submaps as rigid bodies and the places between them (Ni, Steedly and Dellaert, "Out-of-Core
// Bundle Adjustment for Large-Scale 3D Reconstruction", ICCV 2007), so that its size follows from
// the number of submaps and of places, and not from that of images.

#include <cstdint>
#include <vector>

#include "engine/mapping/relaxation_problem.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"
#include "storage/base/transform.h"

namespace veduta {

struct RelaxationOptions {
  // > 0, px. Scale of the Cauchy loss, as that of BundleOptions. Larger, for a submap cannot bend.
  // Chosen by hand; not measured.
  double loss_scale_px = 2.0;
  // >= loss_scale_px, px. It is also tried from such a scale down, a quarter each time: what is not
  // joined yet across a loop is far off. Chosen by hand; not measured.
  double coarse_scale_px = 32.0;
  // >= 1. Steps tried at each scale. Chosen by hand; not measured.
  uint32_t iterations_max = 20;
  // >= 0. The submaps are moved where that lowers the weighted squared errors by more than errors
  // of measurement alone would let it. Such a gain, in units of their variance, has a chi-squared
  // distribution with as many degrees of freedom as there are unknowns: it must exceed the mean by
  // so many standard deviations. 3: one in a thousand would by chance.
  double gain_sigmas_min = 3.0;
  // >= 1. Views of ties that it works on: some, spread over all, so that its time does not grow
  // with the city. And [1, views_max], those by which a solution far away is sought. Chosen by
  // hand.
  uint32_t views_max = 100000;
  uint32_t sought_by_views_max = 20000;

  Status Check() const;
};

struct Relaxation {
  // Whether the submaps are to be moved; nothing else means anything where they are not.
  bool is_significant = false;
  std::vector<Sim3> new_from_old;  // one for each submap
  // Of each submap whether anything holds it. Not one of which the ties want a scale that cannot
  // be: these are left out then, and the others are moved without it.
  std::vector<bool> is_tied;
  std::vector<double> change_px;      // for each submap, how far its views moved: the median
  double initial_cost = 0, cost = 0;  // half the sum of rho(squared error in px)
  bool is_far = false;                // whether that was sought far from where they stand
};

// Moves the submaps. Places are put where they are seen, before and after: only where that cannot
// explain the views does a submap move. Where many views are far off then, a solution far away is
// sought by some of the ties: from a coarse loss, and with bodies of submaps that clearly belong
// elsewhere carried there first (submap_bodies.h). Of these the one of least cost is taken.
// Deterministic at any number of threads. O(views) and, with submaps that touch a bounded number of
// others, O(submaps) for each step. kInvalidArgument on bad options.
Result<Relaxation> RelaxSubmaps(const RelaxationProblem& problem, const RelaxationOptions& options,
                                ThreadPool* pool);

}  // namespace veduta
