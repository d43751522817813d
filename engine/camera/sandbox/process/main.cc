// SPDX-License-Identifier: Apache-2.0
// The program `veduta-decoder`, which `veduta serve` starts for itself.
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "engine/camera/sandbox/exchange.h"
#include "engine/camera/sandbox/process/decoder_process.h"

int main() {
  int kind = 0;
  socklen_t size = sizeof(kind);
  // It is of no use to a person who starts it.
  if (getsockopt(veduta::kControlDescriptor, SOL_SOCKET, SO_TYPE, &kind, &size) != 0 ||
      kind != SOCK_SEQPACKET) {
    return 2;
  }
  prctl(PR_SET_NAME, "veduta-decoder", 0, 0, 0);  // it was started by a descriptor's number
  closefrom(veduta::kControlDescriptor + 1);
  return veduta::RunDecoderProcess(veduta::kControlDescriptor);
}
