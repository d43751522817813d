// SPDX-License-Identifier: Apache-2.0
#include "cli/service/client_presence.h"

#include <sys/poll.h>

namespace veduta {

void ClientPresence::Leave() {
  const std::lock_guard lock(mutex_);
  has_left_ = true;
  socket_ = -1;
}

bool ClientPresence::has_left() const {
  const std::lock_guard lock(mutex_);
  if (has_left_ || socket_ < 0) return has_left_;
  pollfd asked = {socket_, POLLRDHUP, 0};
  return poll(&asked, 1, 0) > 0 && (asked.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

}  // namespace veduta
