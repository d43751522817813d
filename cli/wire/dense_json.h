// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of the dense pass and of what is made from it. docs/json.md lists every key.

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const DensifyReport& report);
Json ToJson(const StageCount& count);
Json ToJson(const PassedOver& photo);
Json ToJson(const DeviceList& list);
Json ToJson(const ExportedModel& model);
Json ToJson(const RenderReport& report);

}  // namespace veduta
