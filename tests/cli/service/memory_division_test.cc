// SPDX-License-Identifier: Apache-2.0
// Goal: the parts have the whole in sum, each is one that its owner takes, and less than the least
//   is refused with the least.
// Method: the least amount, the usual one, odd ones, and those below.
#include "cli/service/memory_division.h"

#include <gtest/gtest.h>

#include "cli/rpc/rpc_door.h"
#include "cli/service/http_door.h"
#include "engine/door/engine_options.h"

namespace veduta {
namespace {

TEST(MemoryDivision, PartsAreTheWholeAndAreTaken) {
  for (const uint64_t bytes : {1ull << 30, (1ull << 30) + 15, 4ull << 30, 1ull << 40}) {
    const auto division = DivideMemory(bytes);
    ASSERT_TRUE(division.ok()) << bytes;
    const uint64_t sum = division->prepare_memory_bytes + division->block_cache_bytes +
                         division->feature_cache_bytes + division->undistort_cache_bytes +
                         division->surface_cache_bytes + division->bodies_bytes_max +
                         division->answers_bytes_max + division->rpc_bytes_max;
    EXPECT_LE(sum, bytes);
    EXPECT_GT(sum, bytes - 16);
    HttpDoorOptions http;
    http.bodies_bytes_max = division->bodies_bytes_max;
    http.answers_bytes_max = division->answers_bytes_max;
    EXPECT_TRUE(http.Check().ok()) << http.Check().message();
    EXPECT_GE(division->rpc_bytes_max, 128ull << 20) << "the least, which one photo may have";
    EngineOptions engine;
    engine.prepare_memory_bytes = division->prepare_memory_bytes;
    engine.block_cache_bytes = division->block_cache_bytes;
    engine.feature_cache_bytes = division->feature_cache_bytes;
    engine.undistort_cache_bytes = division->undistort_cache_bytes;
    engine.surface_cache_bytes = division->surface_cache_bytes;
    EXPECT_TRUE(engine.Check().ok()) << engine.Check().message();
  }
}

TEST(MemoryDivision, OfFourGiBIsWhatTheDaemonTakesByItself) {
  const auto division = DivideMemory(4ull << 30);
  ASSERT_TRUE(division.ok());
  EXPECT_EQ(division->undistort_cache_bytes, EngineOptions().undistort_cache_bytes);
  EXPECT_EQ(division->bodies_bytes_max, HttpDoorOptions().bodies_bytes_max);
  EXPECT_EQ(division->answers_bytes_max, HttpDoorOptions().answers_bytes_max);
  EXPECT_EQ(division->rpc_bytes_max, RpcDoorOptions().bytes_max);
}

TEST(MemoryDivision, TooLittleIsRefusedWithTheLeast) {
  for (const uint64_t bytes : {0ull, 1ull, (1ull << 30) - 1}) {
    const Status refused = DivideMemory(bytes).status();
    EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument);
    EXPECT_NE(refused.message().find("1 GiB (1073741824)"), std::string::npos) << refused.message();
  }
}

}  // namespace
}  // namespace veduta
