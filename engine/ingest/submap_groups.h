// SPDX-License-Identifier: Apache-2.0
#pragma once
// Submaps that lie beside each other, and are adjusted or moved together.

#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "engine/ingest/submaps.h"
#include "engine/mapping/view_graph_parts.h"
#include "storage/database.h"

namespace veduta {

// The verified pairs of the images, each as often as one of the two is given. O(pairs).
Result<std::vector<ViewGraphEdge>> ListEdges(const Snapshot& snapshot,
                                             std::span<const ImageId> images);

// The submaps beside this one in its reconstruction, and how many matches lead to each. O(pairs of
// its images).
Result<std::map<SubmapId, uint64_t>> WeighBeside(const Snapshot& snapshot, const Submaps& submaps,
                                                 const SubmapRecord& submap);

struct SubmapGroup {
  std::vector<SubmapId> submaps;  // the given one first
  std::vector<ImageId> images;    // of all of them, ascending
};

// The submap and those around it: first those beside it, in descending numbers of matches with it,
// then those beside these, and so on, as long as all have at most `images_max` images. Only those
// that have a motion to carry out, or only those that have none. O(pairs of the group).
Result<SubmapGroup> FindGroup(const Snapshot& snapshot, const Submaps& submaps,
                              const SubmapRecord& submap, bool is_moving, size_t images_max);

// Adds motions of submaps of the reconstruction that have none: that of the submap which they share
// most matches with and which has one, the lowest of several, until no more get one.
Status SpreadMotions(const Snapshot& snapshot, const Submaps& submaps,
                     ReconstructionId reconstruction, std::map<SubmapId, Sim3>* motions);

}  // namespace veduta
