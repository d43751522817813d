// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of what is hidden and reported. docs/json.md lists every key.

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const HiddenAnswer& hidden);
Json ToJson(const ReportAnswer& report);

}  // namespace veduta
