// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/submap_groups.h"

#include <algorithm>
#include <functional>
#include <set>
#include <utility>

namespace veduta {

Result<std::vector<ViewGraphEdge>> ListEdges(const Snapshot& snapshot,
                                             std::span<const ImageId> images) {
  std::vector<ViewGraphEdge> edges;
  for (const ImageId id : images) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors, snapshot.ListNeighbors(id));
    for (const PairNeighbor& neighbor : neighbors)
      edges.push_back({id, neighbor.image, neighbor.match_count});
  }
  return edges;
}

Result<std::map<SubmapId, uint64_t>> WeighBeside(const Snapshot& snapshot, const Submaps& submaps,
                                                 const SubmapRecord& submap) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ViewGraphEdge> edges,
                          ListEdges(snapshot, submap.images));
  std::map<SubmapId, uint64_t> weights;
  for (const ViewGraphEdge& edge : edges) {
    const SubmapRecord* const beside = submaps.FindOf(edge.b);
    if (beside != nullptr && beside->id != submap.id &&
        beside->reconstruction == submap.reconstruction)
      weights[beside->id] += edge.weight;
  }
  return weights;
}

Result<SubmapGroup> FindGroup(const Snapshot& snapshot, const Submaps& submaps,
                              const SubmapRecord& submap, bool is_moving, size_t images_max) {
  SubmapGroup group{{submap.id}, submap.images};
  std::set<SubmapId> seen = {submap.id};
  for (size_t asked = 0; asked < group.submaps.size() && group.images.size() < images_max;
       ++asked) {
    const SubmapRecord& from = *submaps.Find(group.submaps[asked]);
    VEDUTA_ASSIGN_OR_RETURN(const auto weights, WeighBeside(snapshot, submaps, from));
    std::vector<std::pair<SubmapId, uint64_t>> beside(weights.begin(), weights.end());
    std::ranges::stable_sort(beside, std::ranges::greater(),
                             &std::pair<SubmapId, uint64_t>::second);
    for (const auto& [id, weight] : beside) {
      const SubmapRecord& record = *submaps.Find(id);
      if (record.motion.has_value() != is_moving || !seen.insert(id).second ||
          group.images.size() + record.images.size() > images_max)
        continue;
      group.submaps.push_back(id);
      group.images.insert(group.images.end(), record.images.begin(), record.images.end());
    }
  }
  std::ranges::sort(group.images);
  return group;
}

Status SpreadMotions(const Snapshot& snapshot, const Submaps& submaps,
                     ReconstructionId reconstruction, std::map<SubmapId, Sim3>* motions) {
  std::map<SubmapId, std::map<SubmapId, uint64_t>> without;
  for (const SubmapId id : submaps.List(reconstruction)) {
    if (motions->contains(id)) continue;
    VEDUTA_ASSIGN_OR_RETURN(without[id], WeighBeside(snapshot, submaps, *submaps.Find(id)));
  }
  const auto spread = [&](const auto& entry) {
    uint64_t most = 0;
    std::optional<Sim3> motion;
    for (const auto& [other, weight] : entry.second) {
      if (weight <= most || !motions->contains(other)) continue;
      most = weight;
      motion = motions->at(other);
    }
    if (motion) motions->emplace(entry.first, *motion);
    return motion.has_value();
  };
  while (std::erase_if(without, spread) > 0) {
  }
  return Status::Ok();
}

}  // namespace veduta
