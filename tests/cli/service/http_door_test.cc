// SPDX-License-Identifier: Apache-2.0
// Goal: the door is opened to this machine alone, and its limits have bounds.
// Method: the options are checked. What the door does is tested over real connections by
//   serve_test.py.
#include "cli/service/http_door.h"

#include <gtest/gtest.h>

#include "tests/option_bounds.h"

namespace veduta {
namespace {

Status CheckAddress(const std::string& address) {
  HttpDoorOptions options;
  options.address = address;
  return options.Check();
}

TEST(HttpDoorOptions, TheDoorIsOfThisMachine) {
  for (const char* address : {"127.0.0.1:80", "localhost:0", "LOCALHOST:1", "[::1]:8484"})
    EXPECT_TRUE(CheckAddress(address).ok()) << address;
  for (const char* address :
       {"", ":80", "*:80", "0.0.0.0:80", "127.0.0.1", "localhost", "[::1]", "[::]:80", "::1:80",
        "127.0.0.1.example.com:80", "example.com:80", "unix:/tmp/x"}) {
    EXPECT_EQ(CheckAddress(address).code(), StatusCode::kInvalidArgument) << address;
  }
}

TEST(HttpDoorOptions, HaveBounds) {
  HttpDoorOptions options;
  options.body_bytes_max = 0;
  EXPECT_FALSE(options.Check().ok());
  options.body_bytes_max = options.bodies_bytes_max + 1;
  EXPECT_FALSE(options.Check().ok());
  options.body_bytes_max = options.bodies_bytes_max;
  EXPECT_TRUE(options.Check().ok());
  ExpectBounds(&HttpDoorOptions::threads, "threads", {0, 65}, {1, 64});
  ExpectBounds(&HttpDoorOptions::connections_max, "connections_max", {0, 100'001}, {1, 100'000});
}

}  // namespace
}  // namespace veduta
