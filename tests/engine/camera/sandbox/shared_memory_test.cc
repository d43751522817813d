// SPDX-License-Identifier: Apache-2.0
// Goal: what is shared for reading cannot be changed, and what is shared for writing cannot be
//   resized under its reader.
// Method: every way of writing and resizing is tried on the descriptor that a child would have.
#include "engine/camera/sandbox/shared_memory.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <vector>

namespace veduta {
namespace {

constexpr uint64_t kSize = 3 << 12;

TEST(SharedMemory, BytesArriveAndStay) {
  std::vector<uint8_t> bytes(kSize + 5);
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<uint8_t>(i * 7);
  const auto memory = ShareForReading(bytes);
  ASSERT_TRUE(memory.ok());
  const auto mapped =
      MappedMemory::Map(memory->number(), bytes.size(), MappedMemory::Access::kRead);
  ASSERT_TRUE(mapped.ok());
  EXPECT_EQ(std::vector<uint8_t>(mapped->data(), mapped->data() + mapped->size_bytes()), bytes);
  EXPECT_EQ(pwrite(memory->number(), "x", 1, 0), -1);
  EXPECT_EQ(errno, EPERM);
  EXPECT_EQ(ftruncate(memory->number(), 0), -1);
  EXPECT_EQ(mmap(nullptr, kSize, PROT_WRITE, MAP_SHARED, memory->number(), 0), MAP_FAILED);
  EXPECT_EQ(fcntl(memory->number(), F_ADD_SEALS, F_SEAL_WRITE), -1);
}

TEST(SharedMemory, AnswersCannotBeResized) {
  const auto memory = ShareForWriting(kSize);
  ASSERT_TRUE(memory.ok());
  const auto mapped = MappedMemory::Map(memory->number(), kSize, MappedMemory::Access::kWrite);
  ASSERT_TRUE(mapped.ok());
  mapped->data()[kSize - 1] = 42;
  const auto seen = MappedMemory::Map(memory->number(), kSize, MappedMemory::Access::kRead);
  ASSERT_TRUE(seen.ok());
  EXPECT_EQ(seen->data()[0], 0);
  EXPECT_EQ(seen->data()[kSize - 1], 42);
  for (const off_t size : {off_t{0}, off_t{1}, off_t{4 * kSize}}) {
    EXPECT_EQ(ftruncate(memory->number(), size), -1);
    EXPECT_EQ(errno, EPERM);
  }
  // A seal against writing would make the writer fail.
  EXPECT_EQ(fcntl(memory->number(), F_ADD_SEALS, F_SEAL_FUTURE_WRITE), -1);
}

TEST(SharedMemory, OfAnotherSizeIsNotMapped) {
  const auto memory = ShareForWriting(kSize);
  ASSERT_TRUE(memory.ok());
  for (const uint64_t size : {uint64_t{0}, kSize - 1, kSize + 1, uint64_t{1} << 62}) {
    EXPECT_FALSE(MappedMemory::Map(memory->number(), size, MappedMemory::Access::kRead).ok());
  }
  EXPECT_FALSE(MappedMemory::Map(-1, kSize, MappedMemory::Access::kRead).ok());
}

}  // namespace
}  // namespace veduta
