// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of tokens. docs/json.md lists every key.

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const TokenAnswer& token);
Json ToJson(const NewToken& token);

}  // namespace veduta
