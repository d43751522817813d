// SPDX-License-Identifier: Apache-2.0
#pragma once
// One connection of RPC, from its first byte to its last.

#include <capnp/rpc-twoparty.h>
#include <kj/async-io.h>
#include <kj/timer.h>

#include <memory>

#include "cli/rpc/caller.h"
#include "cli/rpc/guarded_stream.h"

namespace veduta {

// Limits on time, as GuardedStream has them on messages. Chosen by hand.
struct ConnectionLimits {
  kj::Duration login_time = 15 * kj::SECONDS;  // until somebody has logged in
  kj::Duration read_time = 60 * kj::SECONDS;   // for the client to read one answer
  kj::Duration rest_time = 10 * kj::MINUTES;   // between messages, when no call waits for an answer
  kj::Duration look_time = 1 * kj::SECONDS;    // between two looks at these
  MessageLimits messages;
};

// Speaks with a client. On its thread alone; what the session refers to must outlive it.
class RpcConnection final {
 public:
  RpcConnection(kj::Own<kj::AsyncIoStream> stream, std::shared_ptr<RpcSession> session,
                const ConnectionLimits& limits = {});

  // Ends with the connection: when the client closes it, or breaks a limit.
  kj::Promise<void> Run();

  // Calls wait for their answers, or answers wait to be sent.
  bool is_at_work() const;

 private:
  // Ends when a limit is broken.
  kj::Promise<void> Watch();
  bool IsTooSlow() const;

  const std::shared_ptr<RpcSession> session_;
  const ConnectionLimits limits_;
  const kj::TimePoint start_;
  kj::Own<kj::AsyncIoStream> connection_;
  GuardedStream stream_;
  mutable capnp::TwoPartyVatNetwork network_;
  capnp::RpcSystem<capnp::rpc::twoparty::VatId> system_;
};

}  // namespace veduta
