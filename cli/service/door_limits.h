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
        connections(connections_max),
        connections_of_owner(connections_max),
        followers(std::max(1u, connections_max / 2)) {
    for (const std::string& proxy : proxy_addresses) {
      if (const auto plain = PlainAddress(proxy)) proxies.insert(*plain);
    }
  }
  // Shared with requests and connections that outlive the door.
  const std::shared_ptr<DividedBudget> bodies, answers;
  const std::shared_ptr<DividedBudget> by_address;  // connections of strangers
  Budget connections;
  Budget connections_of_owner;    // whom no stranger keeps out
  Budget followers;               // of them: those who follow events, who leave room for others
  std::set<std::string> proxies;  // that are believed
};

}  // namespace veduta
