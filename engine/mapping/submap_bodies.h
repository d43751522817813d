// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether some submaps of a reconstruction belong elsewhere as one body. better_body.h asks the
// same of images.

#include <vector>

#include "engine/mapping/relaxation_problem.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// Groups submaps by single linkage, those with most points in common first, and carries each group
// that has a clearly better place (body_place.h) there: those first whose place explains the
// largest share, and none that overlaps with one that was carried. Places are put where one of the
// two submaps sees them, and judged by the views of the other. Returns new_from_old of each submap;
// nothing where all stay. Deterministic at any number of threads. O(views * log(submaps)), and 20
// to 40 ms for each of the 16 groups at most that are looked at.
std::vector<Sim3> CarryBodies(const RelaxationProblem& problem, ThreadPool* pool);

}  // namespace veduta
