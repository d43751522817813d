// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which threads a request is for, and in whose turn.

#include <cstdint>
#include <string>

#include "cli/service/city_route.h"
#include "cli/service/http_message.h"

namespace veduta {

// How long the work of a request takes.
enum class WorkKind : uint8_t {
  kShort,    // about as long as the disk does: photos are taken, lists are told
  kLong,     // it computes: photos are localised, pictures and tiles are made
  kCommand,  // it may take hours, and somebody who is in charge has asked for it
};

WorkKind WorkKindOf(const CityRoute& route);

// Who takes turns with others: the owner, a token, or an address where there are no tokens.
std::string AskerOf(const HttpRequest& request);

}  // namespace veduta
