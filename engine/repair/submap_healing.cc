// SPDX-License-Identifier: Apache-2.0
// Submaps. Those of a reconstruction are taken over where they name each of its images once; where
// they do not, it is parted anew when it has next grown.
#include <algorithm>

#include "engine/repair/healing.h"

namespace veduta {
namespace {

constexpr const char* kPartedAnew = "they are left out: it is parted anew when it has next grown";

// Leaves out images that are not in the reconstruction, or in a submap before this one. One that
// has lost some is to be adjusted.
void MendSubmap(const std::set<ImageId>& members, std::set<ImageId>* taken, SubmapRecord* submap) {
  const size_t lost = std::erase_if(submap->images, [&](ImageId id) {
    return !members.contains(id) || !taken->insert(id).second;
  });
  if (lost > 0) submap->images_at_adjustment = 0;
}

}  // namespace

Status HealSubmaps(HealingWork* healing) {
  Result<std::vector<SubmapRecord>> all = healing->from().ListSubmaps();
  if (!all.ok()) {
    if (!IsDamage(all.status())) return all.status();
    healing->notes.Add("the submaps cannot be read: " + all.status().message(),
                       "they are left out: large reconstructions are parted anew when they have "
                       "next grown");
    return Status::Ok();
  }
  std::map<ReconstructionId, std::set<ImageId>> taken;
  for (SubmapRecord& submap : *all) {
    const ReconstructionId id = submap.reconstruction;
    MendSubmap(healing->members[id], &taken[id], &submap);
  }
  for (const auto& [id, images] : taken) {
    if (images == healing->members[id]) continue;
    healing->notes.Add(
        "the submaps of reconstruction " + std::to_string(id.value) + " do not have all its images",
        kPartedAnew);
  }
  for (const SubmapRecord& submap : *all) {
    const ReconstructionId id = submap.reconstruction;
    if (submap.images.empty() || taken[id] != healing->members[id]) continue;
    VEDUTA_RETURN_IF_ERROR(
        healing->writer.Put([&](Transaction& transaction) { transaction.PutSubmap(submap); }));
  }
  return Status::Ok();
}

}  // namespace veduta
