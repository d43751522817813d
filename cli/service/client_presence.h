// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether whoever has asked still waits for the answer.

#include <cstdint>
#include <mutex>

namespace veduta {

// The status of an answer that the client did not wait for, as nginx has it.
inline constexpr uint32_t kClientGoneCode = 499;

// Of one request. Thread-safe.
class ClientPresence final {
 public:
  // `socket` is the descriptor of the connection, which must stay open until Leave; -1: none, and
  // the client is there until Leave.
  explicit ClientPresence(int socket = -1) : socket_(socket) {}
  ClientPresence(const ClientPresence&) = delete;
  ClientPresence& operator=(const ClientPresence&) = delete;

  // The response has ended: it was sent, or the connection was lost.
  void Leave();
  // Whether the response has ended, or the client has closed its side of the connection: it may
  // have closed both, and nobody can tell these two apart before something is written.
  bool has_left() const;

 private:
  mutable std::mutex mutex_;  // held while the socket is asked, which is open then
  int socket_;
  bool has_left_ = false;
};

}  // namespace veduta
