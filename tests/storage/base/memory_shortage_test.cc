// SPDX-License-Identifier: Apache-2.0
// Goal: an exception becomes a status that says what the memory was needed for, and whatever is
//   returned stays as it is.
// Method: work that throws, fails and succeeds.
#include "storage/base/memory_shortage.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

namespace veduta {
namespace {

TEST(MemoryShortage, BecomesAStatusThatNamesThePurpose) {
  const Result<int> result =
      CatchShortage("count the photos", []() -> Result<int> { throw std::bad_alloc(); });
  EXPECT_EQ(result.status().code(), StatusCode::kNoMemory);
  EXPECT_EQ(result.status().message().find("there is not enough memory to count the photos: "), 0u);
  const Status status = CatchShortage("count", []() -> Status { throw std::bad_alloc(); });
  EXPECT_EQ(status.code(), StatusCode::kNoMemory);
}

TEST(MemoryShortage, WhatIsNotThereIsNoShortage) {
  const Status status =
      CatchShortage("count", []() -> Status { throw std::out_of_range("map::at"); });
  EXPECT_EQ(status.code(), StatusCode::kCorruption);
  EXPECT_EQ(status.message(), "an invariant is broken, and so it failed to count: map::at");
}

TEST(MemoryShortage, WhatIsReturnedStaysAsItIs) {
  EXPECT_EQ(*CatchShortage("count", []() -> Result<int> { return 3; }), 3);
  const Status status = CatchShortage("count", [] { return Status::NotFound("no photo"); });
  EXPECT_EQ(status.code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
