// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the threads of the HTTP door have together, and may not exceed.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <string>

#include "cli/service/budget.h"
#include "cli/service/divided_budget.h"
#include "cli/service/remote_address.h"

namespace veduta {

// Thread-safe.
struct DoorLimits {
  // As HttpDoorOptions has them.
  DoorLimits(uint64_t bodies_bytes_max, uint64_t answers_bytes_max, uint32_t connections_max,
             std::span<const std::string> proxy_addresses)
      : bodies(std::make_shared<DividedBudget>(bodies_bytes_max)),
        answers(std::make_shared<DividedBudget>(answers_bytes_max)),
        by_address(std::make_shared<DividedBudget>(connections_max)),
        held(std::make_shared<DividedBudget>(connections_max)),
        followers(std::make_shared<DividedBudget>(std::max(1u, connections_max / 2))),
        connections(connections_max),
        connections_of_owner(connections_max) {
    for (const std::string& proxy : proxy_addresses) {
      if (const auto plain = PlainAddress(proxy)) proxies.insert(*plain);
    }
  }
  // Shared with requests and connections that outlive the door.
  const std::shared_ptr<DividedBudget> bodies, answers;
  const std::shared_ptr<DividedBudget> by_address;  // connections of strangers
  // Of them, by HolderOf: those of requests that may last, which are all but questions, and event
  // streams; and event streams alone, which leave room for others.
  const std::shared_ptr<DividedBudget> held, followers;
  Budget connections;
  Budget connections_of_owner;    // whom no stranger keeps out
  std::set<std::string> proxies;  // that are believed
};

}  // namespace veduta
