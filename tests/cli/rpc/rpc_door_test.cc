// SPDX-License-Identifier: Apache-2.0
// Goal: the door is opened to this machine alone while there are no tokens, and its limits have
//   bounds.
// Method: the options are checked. What the door does is tested over real connections by
//   rpc_test.py.
#include "cli/rpc/rpc_door.h"

#include <gtest/gtest.h>

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
}

}  // namespace
}  // namespace veduta
