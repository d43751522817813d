// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/removal_json.h"

namespace veduta {

Json ToJson(const RemovedPhoto& photo) {
  return {{"image", photo.name},
          {"id", ToJson(photo.image)},
          {"reconstruction", ToJson(photo.reconstruction)},
          {"observations", photo.observations},
          {"unplaced", ToJson(photo.unplaced)},
          {"was_dense", photo.was_dense}};
}

Json ToJson(const RemoveAnswer& answer) {
  return {{"removed", ToJson(answer.removed)},
          {"uploads", answer.uploads},
          {"purged", answer.purged.ok()},
          {"why_not", answer.purged.ok() ? Json(nullptr) : Json(answer.purged.message())},
          {"copies", answer.copies}};
}

Json ToJson(const ForbiddenAnswer& forbidden) {
  const bool is_merge = forbidden.kind == ForbidKind::kMerge;
  const bool is_pair = forbidden.kind == ForbidKind::kPair;
  Json b = is_pair ? ToJson(forbidden.image_b) : Json(nullptr);
  if (is_merge) b = ToJson(forbidden.reconstruction_b);
  return {{"kind", is_merge  ? "merge"
                   : is_pair ? "pair"
                             : "pose"},
          {"a", is_merge ? ToJson(forbidden.reconstruction_a) : ToJson(forbidden.image_a)},
          {"b", std::move(b)},
          {"image_a", is_merge ? Json(nullptr) : Json(forbidden.name_a)},
          {"image_b", is_pair ? Json(forbidden.name_b) : Json(nullptr)},
          {"time", forbidden.time_unix_s},
          {"actor", forbidden.actor},
          {"reason", forbidden.reason}};
}

}  // namespace veduta
