// SPDX-License-Identifier: Apache-2.0
// Goal: the door is opened to this machine alone, and its limits have bounds.
// Method: the options are checked. What the door does is tested over real connections by
//   serve_test.py.
#include "cli/service/http_door.h"

#include <gtest/gtest.h>

#include "tests/option_bounds.h"

namespace veduta {
namespace {

TEST(HttpDoorOptions, TheDoorIsOfThisMachine) {
  HttpDoorOptions options;
  EXPECT_TRUE(options.Check().ok());
  options.address = "0.0.0.0:80";
  EXPECT_EQ(options.Check().code(), StatusCode::kInvalidArgument);
}

TEST(HttpDoorOptions, HaveBounds) {
  HttpDoorOptions options;
  options.body_bytes_max = 0;
  EXPECT_FALSE(options.Check().ok());
  options.body_bytes_max = options.bodies_bytes_max + 1;
  EXPECT_FALSE(options.Check().ok());
  options.body_bytes_max = options.bodies_bytes_max;
  EXPECT_TRUE(options.Check().ok());
  ExpectBounds(&HttpDoorOptions::threads, "threads", {0u, 65u}, {1u, 64u});
  ExpectBounds(&HttpDoorOptions::answers_bytes_max, "answers_bytes_max",
               {uint64_t{0}, (uint64_t{1} << 40) + 1}, {uint64_t{1}, uint64_t{1} << 40});
  ExpectBounds(&HttpDoorOptions::connections_max, "connections_max", {0u, 100'001u},
               {1u, 100'000u});
}

}  // namespace
}  // namespace veduta
