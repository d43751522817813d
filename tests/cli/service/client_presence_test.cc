// SPDX-License-Identifier: Apache-2.0
// Goal: a client is known to have gone when the response has ended, and when its side of the
//   connection is closed, whatever it has sent before.
// Method: both ends of a socket.
#include "cli/service/client_presence.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

namespace veduta {
namespace {

TEST(ClientPresence, EndsWithTheResponse) {
  ClientPresence client;
  EXPECT_FALSE(client.has_left());
  client.Leave();
  EXPECT_TRUE(client.has_left());
}

TEST(ClientPresence, EndsWithTheClientsSideOfTheConnection) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  ClientPresence client(ends[0]);
  EXPECT_FALSE(client.has_left());
  ASSERT_EQ(write(ends[1], "more", 4), 4);
  EXPECT_FALSE(client.has_left()) << "bytes that nobody has read yet are no end";
  close(ends[1]);
  EXPECT_TRUE(client.has_left());
  close(ends[0]);
}

TEST(ClientPresence, AsksNoSocketAfterTheResponse) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  ClientPresence client(ends[0]);
  client.Leave();
  close(ends[0]);
  close(ends[1]);
  EXPECT_TRUE(client.has_left());
}

}  // namespace
}  // namespace veduta
