// SPDX-License-Identifier: Apache-2.0
#pragma once
// A photo on its way, for the one who sent it.

#include <cstdint>
#include <memory>

#include "cli/rpc/caller.h"
#include "cli/rpc/veduta.capnp.h"

namespace veduta {

class TicketServer final : public rpc::Ticket::Server {
 public:
  TicketServer(Caller caller, uint64_t number);

  kj::Promise<void> verdict(VerdictContext context) override;

 private:
  const Caller caller_;
  const uint64_t number_;
  const std::shared_ptr<BudgetShare> thing_;  // it is one of the session's
};

}  // namespace veduta
