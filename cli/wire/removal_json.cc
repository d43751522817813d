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
          {"purged", answer.purged.ok()},
          {"why_not", answer.purged.ok() ? Json(nullptr) : Json(answer.purged.message())},
          {"copies", answer.copies}};
}

Json ToJson(const ForbiddenAnswer& forbidden) {
  const bool is_pair = forbidden.kind == ForbidKind::kPair;
  return {{"kind", is_pair ? "pair" : "merge"},
          {"a", is_pair ? ToJson(forbidden.image_a) : ToJson(forbidden.reconstruction_a)},
          {"b", is_pair ? ToJson(forbidden.image_b) : ToJson(forbidden.reconstruction_b)},
          {"image_a", is_pair ? Json(forbidden.name_a) : Json(nullptr)},
          {"image_b", is_pair ? Json(forbidden.name_b) : Json(nullptr)},
          {"time", forbidden.time_unix_s},
          {"actor", forbidden.actor},
          {"reason", forbidden.reason}};
}

}  // namespace veduta
