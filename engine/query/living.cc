// SPDX-License-Identifier: Apache-2.0
#include "engine/query/living.h"

#include <algorithm>
#include <string>

namespace veduta {

Result<std::vector<ReconstructionRecord>> ListLiving(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ReconstructionRecord> records,
                          snapshot.ListReconstructions());
  std::erase_if(records, [](const ReconstructionRecord& r) { return !r.is_living(); });
  std::stable_sort(records.begin(), records.end(),
                   [](const auto& a, const auto& b) { return a.image_count > b.image_count; });
  return records;
}

Result<std::vector<ReconstructionRecord>> ListSomeLiving(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ReconstructionRecord> living, ListLiving(snapshot));
  if (living.empty()) return Status::NotFound("there is no reconstruction yet: add photos first");
  return living;
}

Result<ReconstructionRecord> LargestLiving(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> living, ListSomeLiving(snapshot));
  return living.front();
}

Result<ReconstructionRecord> GetLiving(const Snapshot& snapshot, ReconstructionId id) {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, snapshot.GetReconstruction(id));
  if (record.is_living()) return record;
  if (record.is_dissolved) {
    return Status::NotFound("reconstruction " + std::to_string(id.value) +
                            " was dissolved: all its images have lost their poses");
  }
  return Status::NotFound("reconstruction " + std::to_string(id.value) +
                          " was merged into reconstruction " +
                          std::to_string(record.merged_into.value));
}

}  // namespace veduta
