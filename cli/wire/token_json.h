// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of tokens. docs/json.md lists every key.

#include <string>

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const TokenAnswer& token);
Json ToJson(const NewToken& token);

// Where a link for reading leads, behind the daemon's address. What stands behind "#" is sent to
// nobody by a browser: the page alone reads it.
std::string LinkPath(const std::string& token);
// What was made for a link: its number and its path.
Json LinkJson(const NewToken& token);

}  // namespace veduta
