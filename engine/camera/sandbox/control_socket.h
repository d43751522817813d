// SPDX-License-Identifier: Apache-2.0
#pragma once
// Messages of a fixed size over a socket that keeps them apart (SOCK_SEQPACKET), with descriptors.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

#include "engine/camera/sandbox/shared_memory.h"

namespace veduta {

enum class Reception : uint8_t { kMessage, kTimeout, kClosed };

// False where the other side is gone. Never raises SIGPIPE.
bool SendMessage(int socket, std::span<const uint8_t> message, std::span<const int> descriptors);
// A message of exactly this size, and as many descriptors as `descriptors` has; whatever else comes
// is taken for a closed socket. Waits for at most `wait_ms`; for ever where it is negative.
Reception ReceiveMessage(int socket, std::span<uint8_t> message, std::span<Descriptor> descriptors,
                         int64_t wait_ms);

template <typename Message>
bool Send(int socket, const Message& message, std::span<const int> descriptors = {}) {
  static_assert(std::is_trivially_copyable_v<Message>);
  return SendMessage(socket, {reinterpret_cast<const uint8_t*>(&message), sizeof(message)},
                     descriptors);
}
template <typename Message>
Reception Receive(int socket, Message* message, std::span<Descriptor> descriptors,
                  int64_t wait_ms) {
  static_assert(std::is_trivially_copyable_v<Message>);
  return ReceiveMessage(socket, {reinterpret_cast<uint8_t*>(message), sizeof(*message)},
                        descriptors, wait_ms);
}

}  // namespace veduta
