// SPDX-License-Identifier: Apache-2.0
// Goal: addresses of this machine are told from all others, and can be listened at.
// Method: texts that are one, and that look like one; sockets at free ports and at a taken one.
#include "cli/service/loopback.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace veduta {
namespace {

uint16_t PortOf(int socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  EXPECT_EQ(getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size), 0);
  EXPECT_EQ(address.sin_addr.s_addr, htonl(INADDR_LOOPBACK));
  return ntohs(address.sin_port);
}

TEST(Loopback, OtherMachinesAreTold) {
  for (const char* address : {"127.0.0.1:80", "localhost:0", "LOCALHOST:1", "[::1]:8484"})
    EXPECT_TRUE(IsLoopbackWithPort(address)) << address;
  for (const char* address :
       {"", ":80", "*:80", "0.0.0.0:80", "127.0.0.1", "localhost", "[::1]", "[::]:80", "::1:80",
        "127.0.0.1.example.com:80", "example.com:80", "unix:/tmp/x"})
    EXPECT_FALSE(IsLoopbackWithPort(address)) << address;
}

TEST(Loopback, ListensAtAPortThatIsFree) {
  const auto socket = ListenAt("localhost:0");
  ASSERT_TRUE(socket.ok()) << socket.status().message();
  const uint16_t port = PortOf(socket->get());
  EXPECT_GT(port, 0);
  const auto again = ListenAt("127.0.0.1:" + std::to_string(port));
  EXPECT_EQ(again.status().code(), StatusCode::kIoError) << "it is taken";
}

TEST(Loopback, APortThatIsNoneIsRefused) {
  for (const char* address : {"localhost:", "localhost:x", "localhost:65536", "localhost:-1",
                              "localhost:80 ", "[::1]:99999"}) {
    EXPECT_EQ(ListenAt(address).status().code(), StatusCode::kIoError) << address;
  }
}

}  // namespace
}  // namespace veduta
