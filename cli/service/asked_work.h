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
  kChange,   // the same, but it waits for the writer's turn, which others may hold for minutes
  kLong,     // it computes: photos are localised, pictures and tiles are made
  kCommand,  // it may take hours, and somebody who is in charge has asked for it
  kRemoval,  // the same, and it must not wait for commands: it ends the pass that one of them makes
};

WorkKind WorkKindOf(const CityRoute& route);

// Who takes turns with others: the owner, a token, or an address where there are no tokens.
std::string AskerOf(const HttpRequest& request);
// Whose part of the memory it takes (DividedBudget): the same, but nobody's of the owner's, and of
// who comes without a token from this machine, as all do by a proxy.
std::string HolderOf(const HttpRequest& request);

}  // namespace veduta
