// SPDX-License-Identifier: Apache-2.0
// Goal: the door is opened to this machine alone while there are no tokens, its limits have bounds,
//   and it keeps to them.
// Method: the options are checked; clients of Cap'n Proto come by a socket, more than may. What
//   else the door does is tested by rpc_test.py.
#include "cli/rpc/rpc_door.h"

#include <capnp/message.h>
#include <capnp/rpc-twoparty.h>
#include <capnp/rpc.capnp.h>
#include <capnp/serialize.h>
#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cli/rpc/veduta.capnp.h"
#include "engine/engine.h"
#include "tests/engine/street_fixture.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

TEST(RpcDoorOptions, TheDoorIsOfThisMachine) {
  RpcDoorOptions options;
  for (const char* own : {"unix:city.veduta/rpc.sock", "localhost:0", "127.0.0.1:80", "[::1]:80"}) {
    options.address = own;
    EXPECT_TRUE(options.Check().ok()) << own;
  }
  for (const char* other : {"", "127.0.0.1", "0.0.0.0:80", "[::]:80", "example.com:80"}) {
    options.address = other;
    EXPECT_EQ(options.Check().code(), StatusCode::kInvalidArgument) << other;
  }
  options.asks_for_tokens = true;
  options.address = "0.0.0.0:80";
  EXPECT_TRUE(options.Check().ok());
}

TEST(RpcDoorOptions, HaveBounds) {
  for (const uint32_t threads : {0u, 65u})
    EXPECT_FALSE(RpcDoorOptions({.address = "[::1]:0", .threads = threads}).Check().ok());
  for (const uint32_t connections : {0u, 100'001u}) {
    EXPECT_FALSE(
        RpcDoorOptions({.address = "[::1]:0", .connections_max = connections}).Check().ok());
  }
  for (const uint64_t bytes : {uint64_t{0}, (uint64_t{128} << 20) - 1, (uint64_t{1} << 40) + 1})
    EXPECT_FALSE(RpcDoorOptions({.address = "[::1]:0", .bytes_max = bytes}).Check().ok());
  EXPECT_OK(RpcDoorOptions({.address = "[::1]:0", .bytes_max = uint64_t{128} << 20}).Check());
}

// Somebody who has come and asks to be let in.
class Guest final {
 public:
  Guest(kj::AsyncIoContext* io, const std::string& address)
      : io_(*io),
        stream_(io_.provider->getNetwork()
                    .parseAddress(address)
                    .wait(io_.waitScope)
                    ->connect()
                    .wait(io_.waitScope)),
        client_(*stream_),
        answer_(client_.bootstrap()
                    .castAs<rpc::Gate>()
                    .loginRequest()
                    .send()
                    .then([](auto&&) { return true; })
                    .eagerlyEvaluate(nullptr)) {}

  bool IsAnsweredWithin(kj::Duration time) {
    auto late = io_.provider->getTimer().afterDelay(time).then([] { return false; });
    auto either = answer_.fork();
    answer_ = either.addBranch();
    return either.addBranch().exclusiveJoin(kj::mv(late)).wait(io_.waitScope);
  }

 private:
  kj::AsyncIoContext& io_;
  kj::Own<kj::AsyncIoStream> stream_;
  capnp::TwoPartyClient client_;
  kj::Promise<bool> answer_;
};

// A client without manners: says what it is told to, again and again, as fast as it is heard.
class Chatterer final {
 public:
  Chatterer(const std::string& path, const std::vector<kj::byte>& words)
      : socket_(socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::ranges::copy(path, address.sun_path);
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    talker_ = std::jthread([this, words] {
      while (send(socket_, words.data(), words.size(), MSG_NOSIGNAL) > 0) {
      }
      is_talking_ = false;
    });
    listener_ = std::jthread([this] {
      std::vector<kj::byte> answers(1 << 20);
      while (recv(socket_, answers.data(), answers.size(), 0) > 0) {
      }
    });
  }
  ~Chatterer() {
    shutdown(socket_, SHUT_RDWR);
    talker_.join();
    listener_.join();
    close(socket_);
  }
  Chatterer(const Chatterer&) = delete;
  Chatterer& operator=(const Chatterer&) = delete;

  bool is_talking() const { return is_talking_; }

 private:
  const int socket_;
  std::atomic<bool> is_talking_ = true;
  std::jthread talker_, listener_;
};

// Adds a message to `bytes`.
template <typename Fill>
void Say(std::vector<kj::byte>* bytes, const Fill& fill) {
  capnp::MallocMessageBuilder message;
  fill(message.initRoot<capnp::rpc::Message>());
  const kj::Array<capnp::word> words = capnp::messageToFlatArray(message);
  bytes->insert(bytes->end(), words.asBytes().begin(), words.asBytes().end());
}

// Asks to be let in, and wants to hear no more of it, a thousand times.
std::vector<kj::byte> ManyQuestions() {
  std::vector<kj::byte> bytes;
  for (int i = 0; i < 1000; ++i) {
    Say(&bytes, [](auto message) { message.initBootstrap().setQuestionId(1); });
    Say(&bytes, [](auto message) {
      auto call = message.initCall();
      call.setQuestionId(2);
      call.initTarget().initPromisedAnswer().setQuestionId(1);
      call.setInterfaceId(capnp::typeId<rpc::Gate>());
      call.initParams().getContent().template initAs<rpc::Gate::LoginParams>().setToken("");
    });
    for (const uint32_t question : {2, 1}) {
      Say(&bytes, [question](auto message) {
        auto finish = message.initFinish();
        finish.setQuestionId(question);
        finish.setReleaseResultCaps(true);
      });
    }
  }
  return bytes;
}

class RpcDoorTest : public ::testing::Test {
 protected:
  // The address of a door of one thread.
  std::string Open(uint32_t connections_max) {
    city_.Close();
    auto engine = Engine::Open(city_.path());
    EXPECT_OK(engine);
    service_.emplace(*std::move(engine), city_.path(), ServiceOptions(), CityService::Listeners());
    const RpcDoorOptions options{
        .address = "unix:" + path(), .connections_max = connections_max, .threads = 1};
    auto door = RpcDoor::Open(&*service_, options, [](const Status&) {});
    EXPECT_OK(door);
    door_ = *std::move(door);
    return options.address;
  }
  std::string path() const { return city_.path() + "/door.sock"; }

  City city_;
  std::optional<CityService> service_;
  std::unique_ptr<RpcDoor> door_;
};

TEST_F(RpcDoorTest, WhoNeverPausesKeepsNobodyFromTheirTurn) {
  const std::string address = Open(16);
  kj::AsyncIoContext io = kj::setupAsyncIo();
  std::vector<std::unique_ptr<Chatterer>> chatterers;
  for (int i = 0; i < 8; ++i)
    chatterers.push_back(std::make_unique<Chatterer>(path(), ManyQuestions()));
  for (int i = 0; i < 20; ++i) {
    Guest guest(&io, address);
    ASSERT_TRUE(guest.IsAnsweredWithin(10 * kj::SECONDS)) << i;
  }
  for (const auto& one : chatterers) EXPECT_TRUE(one->is_talking());
}

TEST_F(RpcDoorTest, MoreConnectionsWaitUntilOneEnds) {
  const std::string address = Open(2);
  kj::AsyncIoContext io = kj::setupAsyncIo();
  auto first = std::make_unique<Guest>(&io, address);
  Guest second(&io, address);
  EXPECT_TRUE(first->IsAnsweredWithin(10 * kj::SECONDS));
  EXPECT_TRUE(second.IsAnsweredWithin(10 * kj::SECONDS));
  Guest third(&io, address);
  EXPECT_FALSE(third.IsAnsweredWithin(200 * kj::MILLISECONDS));
  first.reset();
  EXPECT_TRUE(third.IsAnsweredWithin(10 * kj::SECONDS));
}

}  // namespace
}  // namespace veduta
