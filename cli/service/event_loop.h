// SPDX-License-Identifier: Apache-2.0
#pragma once
// The loop of a thread that serves connections.

#include <kj/async-io.h>

namespace veduta {

// The loop of this thread. It looks for what has come from others, for timers and for a stop after
// some events at the latest: kj's own looks when nothing is left to do, and a client that always
// has something more to say would keep all others from their turn.
inline kj::AsyncIoContext MakeEventLoop() {
  auto io = kj::setupAsyncIo();
  io.waitScope.setBusyPollInterval(100);  // chosen by hand: a look takes about as long as one event
  return io;
}

}  // namespace veduta
