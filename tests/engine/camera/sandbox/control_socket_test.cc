// SPDX-License-Identifier: Apache-2.0
// Goal: a message arrives whole with its descriptors, or not at all, and no descriptor is lost.
// Method: both ends of one socket; messages of another size, with too many and too few descriptors;
//   the descriptors that are open are counted before and after.
#include "engine/camera/sandbox/control_socket.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <vector>

#include "tests/engine/camera/sandbox/processes.h"

namespace veduta {
namespace {

using testing::OpenDescriptorCount;

struct Message {
  uint32_t number = 0;
  std::array<char, 60> text = {};
};

class ControlSocketTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::array<int, 2> ends = {-1, -1};
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()), 0);
    here_ = Descriptor(ends[0]);
    there_ = Descriptor(ends[1]);
  }
  Reception Get(Message* message, std::span<Descriptor> descriptors = {}) {
    return Receive(there_.number(), message, descriptors, 100);
  }

  Descriptor here_, there_;
};

TEST_F(ControlSocketTest, MessagesArriveWithTheirDescriptors) {
  const auto memory = ShareForReading(std::vector<uint8_t>{1, 2, 3});
  ASSERT_TRUE(memory.ok());
  const size_t before = OpenDescriptorCount();
  {
    ASSERT_TRUE(Send(here_.number(), Message{7, {"seven"}},
                     std::array{memory->number(), memory->number()}));
    Message got;
    std::array<Descriptor, 2> descriptors;
    ASSERT_EQ(Get(&got, descriptors), Reception::kMessage);
    EXPECT_EQ(got.number, 7u);
    EXPECT_STREQ(got.text.data(), "seven");
    const auto mapped = MappedMemory::Map(descriptors[1].number(), 3, MappedMemory::Access::kRead);
    ASSERT_TRUE(mapped.ok());
    EXPECT_EQ(mapped->data()[2], 3);
  }
  EXPECT_EQ(OpenDescriptorCount(), before);
}

TEST_F(ControlSocketTest, WhatIsNoSuchMessageCloses) {
  const size_t before = OpenDescriptorCount();
  Message got;
  std::array<Descriptor, 1> one;
  ASSERT_TRUE(SendMessage(here_.number(), std::vector<uint8_t>(3), {}));
  EXPECT_EQ(Get(&got), Reception::kClosed);
  ASSERT_TRUE(SendMessage(here_.number(), std::vector<uint8_t>(sizeof(Message) + 1), {}));
  EXPECT_EQ(Get(&got), Reception::kClosed);
  ASSERT_TRUE(Send(here_.number(), Message()));
  EXPECT_EQ(Get(&got, one), Reception::kClosed);
  ASSERT_TRUE(Send(here_.number(), Message(), std::array{0, 1}));
  EXPECT_EQ(Get(&got, one), Reception::kClosed);
  one[0] = Descriptor();
  EXPECT_EQ(OpenDescriptorCount(), before);
}

TEST_F(ControlSocketTest, SilenceAndTheOtherSidesEndAreTold) {
  Message got;
  EXPECT_EQ(Get(&got), Reception::kTimeout);
  EXPECT_EQ(Receive(there_.number(), &got, {}, 0), Reception::kTimeout);
  here_ = Descriptor();
  EXPECT_EQ(Get(&got), Reception::kClosed);
  EXPECT_FALSE(Send(there_.number(), Message()));
}

}  // namespace
}  // namespace veduta
