// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/rpc_connection.h"

#include <utility>

#include "cli/rpc/city_server.h"

namespace veduta {
namespace {

// Of calls that are at work: the daemon reads no further while they have more. Four messages of the
// greatest size, so that nobody who keeps to the limits waits for it.
constexpr size_t kFlowWords = 512 << 10;

// A message of the greatest size is read once, some of it twice. A message of ours nests some ten
// levels deep.
capnp::ReaderOptions Reading() {
  capnp::ReaderOptions options;
  options.traversalLimitInWords = kFlowWords;
  options.nestingLimit = 32;
  return options;
}

}  // namespace

RpcConnection::RpcConnection(kj::Own<kj::AsyncIoStream> stream, std::shared_ptr<RpcSession> session,
                             const ConnectionLimits& limits)
    : session_(std::move(session)),
      limits_(limits),
      start_(session_->timer.now()),
      connection_(kj::mv(stream)),
      stream_(connection_.get(), &session_->timer, limits.messages),
      network_(stream_, capnp::rpc::twoparty::Side::SERVER, Reading()),
      system_(capnp::makeRpcServer(network_, kj::heap<GateServer>(session_))) {
  stream_.AskQueue([this] { return network_.getCurrentQueueSize(); });
  stream_.AskStranger([this] { return !session_->has_logged_in; });
  system_.setFlowLimit(kFlowWords);
}

kj::Promise<void> RpcConnection::Run() {
  return network_.onDisconnect().exclusiveJoin(Watch());
}

bool RpcConnection::is_at_work() const {
  return session_->calls->used() + session_->verdicts->used() > 0 ||
         network_.getCurrentQueueSize() > 0;
}

kj::Promise<void> RpcConnection::Watch() {
  return session_->timer.afterDelay(limits_.look_time).then([this]() -> kj::Promise<void> {
    if (IsTooSlow()) return kj::READY_NOW;
    return Watch();
  });
}

bool RpcConnection::IsTooSlow() const {
  const kj::TimePoint now = session_->timer.now();
  if (!session_->has_logged_in && now - start_ > limits_.login_time) return true;
  if (network_.getOutgoingMessageWaitTime() > limits_.read_time) return true;
  const uint64_t waiting =
      session_->calls->used() + session_->verdicts->used() + session_->watchers->used();
  return waiting == 0 && now - stream_.last_read() > limits_.rest_time;
}

}  // namespace veduta
