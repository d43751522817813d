// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/retries.h"

#include <algorithm>
#include <map>
#include <vector>

#include "engine/query/forbidden.h"

namespace veduta {
namespace {

// So many neighbours count each. On a walk of 14 photos one had failed beside more than 8, and got
// its pose by the next one.
constexpr uint32_t kEachUpTo = 16;

// Photos that wait, in the order in which they are come across, with how many of their neighbours
// the placement has placed.
class Waiting final {
 public:
  void Add(ImageId id) {
    const auto [it, is_new] = gained_.try_emplace(id, 0);
    ++it->second;
    if (is_new) order_.push_back(id);
  }
  const std::vector<ImageId>& order() const { return order_; }
  uint32_t gained(ImageId id) const { return gained_.at(id); }

 private:
  std::vector<ImageId> order_;
  std::map<ImageId, uint32_t> gained_;
};

Result<bool> HasPose(const CityMap& map, const Snapshot& base, ImageId id) {
  if (map.HasImage(id)) return true;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, base.FindPose(id));
  return pose.has_value();
}

Result<Waiting> FindWaiting(const CityMap& map, const Snapshot& base, const Placement& placement,
                            std::span<const ImageId> unstored) {
  Waiting waiting;
  for (const ImageId id : placement.placed) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors, base.ListNeighbors(id));
    for (const PairNeighbor& neighbor : neighbors) {
      VEDUTA_ASSIGN_OR_RETURN(const bool has_pose, HasPose(map, base, neighbor.image));
      if (has_pose) continue;
      VEDUTA_ASSIGN_OR_RETURN(const bool is_forbidden, IsPoseForbidden(base, neighbor.image));
      if (!is_forbidden) waiting.Add(neighbor.image);
    }
  }
  for (const ImageId id : unstored) {
    if (!map.HasImage(id)) waiting.Add(id);
  }
  return waiting;
}

// Those of its stored neighbours that have a pose.
Result<uint32_t> CountPlacedNeighbors(const CityMap& map, const Snapshot& base, ImageId id) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors, base.ListNeighbors(id));
  uint32_t count = 0;
  for (const PairNeighbor& neighbor : neighbors) {
    VEDUTA_ASSIGN_OR_RETURN(const bool has_pose, HasPose(map, base, neighbor.image));
    if (has_pose) ++count;
  }
  return count;
}

}  // namespace

bool IsWorthAnother(uint32_t before, uint32_t after) {
  uint32_t count = 1;  // at which it is tried
  while (count <= before) count += count < kEachUpTo ? 1 : count / 4;
  return count <= after;
}

Status AppendRetries(const CityMap& map, const Snapshot& base, const Placement& placement,
                     std::span<const ImageId> unstored, DatabaseState* state) {
  if (placement.placed.empty()) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const Waiting waiting, FindWaiting(map, base, placement, unstored));
  std::vector<ImageId>& retries = state->pending_propagation;
  for (const ImageId id : waiting.order()) {
    if (std::ranges::find(retries, id) != retries.end()) continue;
    VEDUTA_ASSIGN_OR_RETURN(uint32_t after, CountPlacedNeighbors(map, base, id));
    if (std::ranges::find(unstored, id) != unstored.end()) ++after;
    const uint32_t before = after - std::min(after, waiting.gained(id));
    if (!placement.merges.empty() || IsWorthAnother(before, after)) retries.push_back(id);
  }
  return Status::Ok();
}

}  // namespace veduta
