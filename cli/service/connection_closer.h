// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tells a client that no further request of its connection is taken (Connection: close).

#include <kj/compat/http.h>

#include <utility>

namespace veduta {

// Of all connections of one thread: kj asks as each answer begins. Version 0.9 of it tells the
// client, and takes further requests all the same: to refuse these is left to whoever has it told.
class ConnectionCloser final : public kj::HttpServerCallbacks {
 public:
  // The answer that is begun next is the last one of its connection.
  void CloseAfterNext() { is_next_last_ = true; }
  bool shouldClose() override { return std::exchange(is_next_last_, false); }

 private:
  bool is_next_last_ = false;
};

}  // namespace veduta
