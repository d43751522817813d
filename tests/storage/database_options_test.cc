// SPDX-License-Identifier: Apache-2.0
// Goal: options outside their bounds are refused by name and value, and Open asks.
// Method: each bound from both sides.
#include "storage/database_options.h"

#include <gtest/gtest.h>

#include "samples.h"

namespace veduta {
namespace {

TEST(DatabaseOptions, DefaultsAndBoundsAreAccepted) {
  EXPECT_OK(DatabaseOptions().Check());
  EXPECT_OK(DatabaseOptions{.create = true}.Check());
  EXPECT_OK(DatabaseOptions{.read_only = true}.Check());
  EXPECT_OK(DatabaseOptions{.block_cache_bytes = 1ull << 20}.Check());
  EXPECT_OK(DatabaseOptions{.block_cache_bytes = 1ull << 40}.Check());
}

TEST(DatabaseOptions, ViolatedBoundIsNamed) {
  for (const uint64_t bytes : {uint64_t{0}, (uint64_t{1} << 20) - 1, (uint64_t{1} << 40) + 1}) {
    const Status status = DatabaseOptions{.block_cache_bytes = bytes}.Check();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_NE(status.message().find("block_cache_bytes is " + std::to_string(bytes)),
              std::string::npos)
        << status.message();
  }
  const Status both = DatabaseOptions{.create = true, .read_only = true}.Check();
  EXPECT_EQ(both.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(both.message().find("create and read_only"), std::string::npos) << both.message();
}

TEST(DatabaseOptions, OpenChecksBeforeItTouchesAnything) {
  const TemporaryFolder folder;
  const auto opened = Database::Open(folder / "db", {.create = true, .block_cache_bytes = 0});
  EXPECT_EQ(opened.status().code(), StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder / "db"));
}

}  // namespace
}  // namespace veduta
