// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of what becomes of an imported model. docs/json.md lists every key.

#include "cli/wire/json.h"
#include "engine/door/model_import.h"

namespace veduta {

Json ToJson(const ImportedPhoto& photo);
Json ToJson(const ImportAnswer& answer);

}  // namespace veduta
