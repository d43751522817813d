// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/rpc_door.h"

#include <kj/async-io.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "cli/rpc/rpc_connection.h"
#include "cli/service/event_loop.h"
#include "cli/service/loopback.h"
#include "cli/service/own_socket.h"
#include "cli/service/remote_address.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// How long the calls at work have when the daemon stops; and before each look at whether there are
// any, while what came by then is read, answered and sent.
constexpr kj::Duration kDrainTime = 5 * kj::SECONDS, kDrainLook = 10 * kj::MILLISECONDS;
// Before the next connection is taken where there are too many, or where taking one failed.
constexpr kj::Duration kPauseTime = 20 * kj::MILLISECONDS;
// After so long without a sign of life from the other machine it is asked for one, and given up
// after as much again.
constexpr int kAliveS = 60;

constexpr std::string_view kUnix = "unix:";

bool IsUnix(const std::string& address) {
  return address.starts_with(kUnix);
}

std::string PathOf(const std::string& address) {
  return address.substr(kUnix.size());
}

// What one thread does.
class ConnectionTaker final : private kj::TaskSet::ErrorHandler {
 public:
  ConnectionTaker(const RpcShared& shared, kj::AsyncIoContext* io, kj::ConnectionReceiver* port,
                  bool is_unix)
      : shared_(shared),
        timer_(io->provider->getTimer()),
        port_(*port),
        is_unix_(is_unix),
        running_(*this) {}

  // Takes connections for ever.
  kj::Promise<void> Accept() {
    auto place = std::make_shared<BudgetShare>(shared_.connections);
    if (!place->Grow(1)) return AcceptLater();
    // It may throw instead of promising, and that must reach the handler below, too.
    return kj::evalNow([this] { return port_.accept(); })
        .then([this, place](kj::Own<kj::AsyncIoStream> stream) {
          auto of_address = kj::heap<DividedShare>(
              shared_.by_address, is_unix_ ? "" : CountedSender(PeerOf(*stream), {}));
          if (of_address->Grow(1))  // otherwise it is closed
            Take(kj::mv(stream).attach(kj::mv(of_address)), place);
        })
        .then([this] { return Accept(); },
              // Too many open files, mostly: that passes.
              [this](kj::Exception&&) { return AcceptLater(); });
  }

  // Ends when all calls are answered, or late answers are given up.
  kj::Promise<void> Drain() {
    is_stopping_ = true;
    return AwaitRest().exclusiveJoin(timer_.afterDelay(kDrainTime));
  }

 private:
  void Take(kj::Own<kj::AsyncIoStream> stream, std::shared_ptr<BudgetShare> place) {
    if (!is_unix_) {
      const int on = 1;
      stream->setsockopt(IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      stream->setsockopt(SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
      stream->setsockopt(IPPROTO_TCP, TCP_KEEPIDLE, &kAliveS, sizeof kAliveS);
      const int every_s = kAliveS / 4;
      stream->setsockopt(IPPROTO_TCP, TCP_KEEPINTVL, &every_s, sizeof every_s);
    }
    const auto session = std::make_shared<RpcSession>(shared_, &timer_, &is_stopping_, is_unix_);
    auto connection = std::make_shared<RpcConnection>(kj::mv(stream), session);
    connections_.push_back(connection);
    auto running = connection->Run();
    running_.add(running.attach(kj::mv(connection), kj::mv(place)));
    std::erase_if(connections_, [](const auto& one) { return one.expired(); });
  }

  // Never looks at once: a call that has ended in this turn of the loop has its answer still to be
  // sent.
  kj::Promise<void> AwaitRest() {
    return timer_.afterDelay(kDrainLook).then([this]() -> kj::Promise<void> {
      const auto is_at_work = [](const auto& one) {
        const auto connection = one.lock();
        return connection && connection->is_at_work();
      };
      if (std::ranges::any_of(connections_, is_at_work)) return AwaitRest();
      return kj::READY_NOW;
    });
  }

  kj::Promise<void> AcceptLater() {
    return timer_.afterDelay(kPauseTime).then([this] { return Accept(); });
  }

  // Clients vanish, and send what is no message: that ends their connection and nothing else.
  void taskFailed(kj::Exception&&) override {}

  const RpcShared& shared_;
  kj::Timer& timer_;
  kj::ConnectionReceiver& port_;
  const bool is_unix_;
  bool is_stopping_ = false;
  std::vector<std::weak_ptr<RpcConnection>> connections_;  // that `running_` holds
  kj::TaskSet running_;
};

Result<kj::AutoCloseFd> Listen(const std::string& address) {
  return IsUnix(address) ? ListenAtPath(PathOf(address)) : ListenAt(address);
}

uint16_t PortOf(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<sockaddr_in&>(address).sin_port);
}

}  // namespace

Status RpcDoorOptions::Check() const {
  if (!IsUnix(address) && !asks_for_tokens && !IsLoopbackWithPort(address)) {
    return Status::InvalidArgument(
        "the address '" + address +
        "' must be unix:PATH, or localhost, 127.0.0.1 or [::1] with a port, since whoever reaches "
        "the daemon may do anything, until there is a token: 'veduta token create' makes one");
  }
  return OptionBounds()
      .Between("connections_max", connections_max, 1, 100'000)
      .Between("bytes_max", static_cast<double>(bytes_max), kRpcPhotoBytesMax, 0x1p40)
      .Between("threads", threads, 1, 64)
      .status();
}

struct RpcDoor::Parts {
  Parts(CityService* service, const RpcDoorOptions& o, std::function<void(const Status&)> f)
      : options(o), failed(std::move(f)), shared(service, o.connections_max, o.bytes_max) {}

  // Serves connections on this thread until a stop is requested.
  void Serve() {
    try {
      auto io = MakeEventLoop();
      auto port = io.lowLevelProvider->wrapListenSocketFd(socket.get());
      ConnectionTaker taker(shared, &io, port.get(), IsUnix(options.address));
      auto paf = kj::newPromiseAndCrossThreadFulfiller<bool>();
      const Sender<bool> stopped(kj::mv(paf.fulfiller));
      const std::stop_callback on_stop(stop.get_token(), [&] { stopped(true); });
      {
        const auto accepting = taker.Accept().eagerlyEvaluate(nullptr);
        paf.promise.wait(io.waitScope);
      }
      shared.service->Close();
      taker.Drain().wait(io.waitScope);
    } catch (const kj::Exception& exception) {
      failed(Status::IoError("cannot serve at " + options.address + ": " +
                             exception.getDescription().cStr()));
    } catch (const std::exception& exception) {
      failed(Status::NoMemory(std::string("the daemon cannot go on: ") + exception.what()));
    }
  }

  const RpcDoorOptions options;
  const std::function<void(const Status&)> failed;
  const RpcShared shared;
  std::string address;
  kj::AutoCloseFd socket;
  std::stop_source stop;
  std::vector<std::jthread> threads;
};

Result<std::unique_ptr<RpcDoor>> RpcDoor::Open(CityService* service, const RpcDoorOptions& options,
                                               std::function<void(const Status&)> failed) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  auto parts = std::make_unique<Parts>(service, options, std::move(failed));
  VEDUTA_ASSIGN_OR_RETURN(parts->socket, Listen(options.address));
  parts->address = IsUnix(options.address) ? options.address
                                           : HostOf(options.address) + ":" +
                                                 std::to_string(PortOf(parts->socket.get()));
  std::unique_ptr<RpcDoor> door(new RpcDoor(std::move(parts)));
  for (uint32_t i = 0; i < options.threads; ++i)
    door->parts_->threads.emplace_back([all = door->parts_.get()] { all->Serve(); });
  return door;
}

RpcDoor::RpcDoor(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

RpcDoor::~RpcDoor() {
  Stop();
  parts_->threads.clear();
  if (IsUnix(parts_->options.address)) unlink(PathOf(parts_->options.address).c_str());
}

void RpcDoor::Stop() {
  parts_->stop.request_stop();
}

const std::string& RpcDoor::address() const {
  return parts_->address;
}

}  // namespace veduta
