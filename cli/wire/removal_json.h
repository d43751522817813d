// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of removals and of what people forbid. docs/json.md lists every key.

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const RemovedPhoto& photo);
Json ToJson(const RemoveAnswer& answer);
Json ToJson(const ForbiddenAnswer& forbidden);

}  // namespace veduta
