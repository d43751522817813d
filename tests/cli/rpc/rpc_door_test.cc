// SPDX-License-Identifier: Apache-2.0
// Goal: the door is opened to this machine alone while there are no tokens, its limits have bounds,
//   and it keeps to them.
// Method: the options are checked; clients of Cap'n Proto come by a socket, more than may. What
//   else the door does is tested by rpc_test.py.
#include "cli/rpc/rpc_door.h"

#include <capnp/rpc-twoparty.h>
#include <gtest/gtest.h>
#include <kj/async-io.h>

#include <memory>
#include <string>

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

TEST(RpcDoor, MoreConnectionsWaitUntilOneEnds) {
  City city;
  city.Close();
  auto engine = Engine::Open(city.path());
  ASSERT_OK(engine);
  CityService service(*std::move(engine), city.path(), ServiceOptions(), CityService::Listeners());
  const RpcDoorOptions options{
      .address = "unix:" + city.path() + "/door.sock", .connections_max = 2, .threads = 1};
  const auto door = RpcDoor::Open(&service, options, [](const Status&) {});
  ASSERT_OK(door);
  kj::AsyncIoContext io = kj::setupAsyncIo();
  auto first = std::make_unique<Guest>(&io, options.address);
  Guest second(&io, options.address);
  EXPECT_TRUE(first->IsAnsweredWithin(10 * kj::SECONDS));
  EXPECT_TRUE(second.IsAnsweredWithin(10 * kj::SECONDS));
  Guest third(&io, options.address);
  EXPECT_FALSE(third.IsAnsweredWithin(200 * kj::MILLISECONDS));
  first.reset();
  EXPECT_TRUE(third.IsAnsweredWithin(10 * kj::SECONDS));
}

}  // namespace
}  // namespace veduta
