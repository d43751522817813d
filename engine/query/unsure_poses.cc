// SPDX-License-Identifier: Apache-2.0
#include "engine/query/unsure_poses.h"

#include <algorithm>
#include <optional>

namespace veduta {

Result<UnsureImages> ListUnsure(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all, snapshot.ListHypotheses());
  UnsureImages unsure;
  for (const HypothesisRecord& hypothesis : all) {
    for (const ImageId image : hypothesis.unsure) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(image));
      // It may have lost its pose since, or have got one in a third reconstruction.
      if (!pose) continue;
      if (pose->reconstruction == hypothesis.a) unsure[image].push_back(hypothesis.b);
      if (pose->reconstruction == hypothesis.b) unsure[image].push_back(hypothesis.a);
    }
  }
  for (auto& [image, others] : unsure) std::ranges::sort(others);
  return unsure;
}

}  // namespace veduta
