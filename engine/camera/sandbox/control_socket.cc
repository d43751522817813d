// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sandbox/control_socket.h"

#include <sys/poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

namespace veduta {
namespace {

constexpr size_t kDescriptorsMax = 2;

// Room for the descriptors of one message, aligned as the system wants it.
union ControlRoom {
  char bytes[CMSG_SPACE(kDescriptorsMax * sizeof(int))];
  cmsghdr alignment;
};

// Whether something can be read within the time.
bool Awaits(int socket, int64_t wait_ms) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + std::chrono::milliseconds(wait_ms);
  for (;;) {
    pollfd awaited{socket, POLLIN, 0};
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
    const int64_t left_ms = std::clamp<int64_t>(left, 0, 1 << 30);
    const int ready = poll(&awaited, 1, wait_ms < 0 ? -1 : static_cast<int>(left_ms));
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) return true;  // reading says what is wrong
  }
}

// Takes over all that have come. False where these are not as many as there is room for.
bool TakeDescriptors(msghdr* header, std::span<Descriptor> descriptors) {
  size_t count = 0;
  for (cmsghdr* part = CMSG_FIRSTHDR(header); part != nullptr; part = CMSG_NXTHDR(header, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    const size_t there = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (size_t i = 0; i < there; ++i, ++count) {
      int number = -1;
      std::memcpy(&number, CMSG_DATA(part) + i * sizeof(int), sizeof(int));
      Descriptor taken(number);
      if (count < descriptors.size()) descriptors[count] = std::move(taken);
    }
  }
  return count == descriptors.size();
}

}  // namespace

bool SendMessage(int socket, std::span<const uint8_t> message, std::span<const int> descriptors) {
  iovec bytes{const_cast<uint8_t*>(message.data()), message.size()};
  ControlRoom room = {};
  msghdr header{};
  header.msg_iov = &bytes;
  header.msg_iovlen = 1;
  if (!descriptors.empty()) {
    header.msg_control = room.bytes;
    header.msg_controllen = CMSG_SPACE(descriptors.size_bytes());
    cmsghdr* const part = CMSG_FIRSTHDR(&header);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(descriptors.size_bytes());
    std::memcpy(CMSG_DATA(part), descriptors.data(), descriptors.size_bytes());
  }
  for (;;) {
    const ssize_t sent = sendmsg(socket, &header, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    return sent == static_cast<ssize_t>(message.size());
  }
}

Reception ReceiveMessage(int socket, std::span<uint8_t> message, std::span<Descriptor> descriptors,
                         int64_t wait_ms) {
  if (!Awaits(socket, wait_ms)) return Reception::kTimeout;
  iovec bytes{message.data(), message.size()};
  ControlRoom room = {};
  msghdr header{};
  header.msg_iov = &bytes;
  header.msg_iovlen = 1;
  header.msg_control = room.bytes;
  header.msg_controllen = sizeof(room);
  ssize_t received = -1;
  do {
    received = recvmsg(socket, &header, MSG_CMSG_CLOEXEC);
  } while (received < 0 && errno == EINTR);
  if (received < 0) return Reception::kClosed;
  const bool has_all = TakeDescriptors(&header, descriptors);
  const bool is_whole = received == static_cast<ssize_t>(message.size()) &&
                        (header.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) == 0;
  return has_all && is_whole ? Reception::kMessage : Reception::kClosed;
}

}  // namespace veduta
