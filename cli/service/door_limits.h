// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the threads of the HTTP door have together, and may not exceed.

#include <algorithm>
#include <memory>
#include <set>
#include <string>

#include "cli/service/budget.h"
#include "cli/service/divided_budget.h"
#include "cli/service/http_door.h"
#include "cli/service/remote_address.h"

namespace veduta {

// Thread-safe. The options must outlive it.
struct DoorLimits {
  explicit DoorLimits(const HttpDoorOptions& o)
      : options(o),
        bodies(std::make_shared<DividedBudget>(o.bodies_bytes_max)),
        answers(std::make_shared<DividedBudget>(o.answers_bytes_max)),
        by_address(std::make_shared<DividedBudget>(o.connections_max)),
        connections(o.connections_max),
        connections_of_owner(o.connections_max),
        followers(std::max(1u, o.connections_max / 2)) {
    for (const std::string& proxy : o.proxies) {
      if (const auto plain = PlainAddress(proxy)) proxies.insert(*plain);
    }
  }
  const HttpDoorOptions& options;
  // Shared with requests and connections that outlive the door.
  const std::shared_ptr<DividedBudget> bodies, answers;
  const std::shared_ptr<DividedBudget> by_address;  // connections of strangers
  Budget connections;
  Budget connections_of_owner;    // whom no stranger keeps out
  Budget followers;               // of them: those who follow events, who leave room for others
  std::set<std::string> proxies;  // that are believed
};

}  // namespace veduta
