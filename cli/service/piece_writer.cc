// SPDX-License-Identifier: Apache-2.0
#include "cli/service/piece_writer.h"

namespace veduta {

kj::Promise<void> WriteInPieces(kj::Timer* timer, kj::AsyncOutputStream* out,
                                std::string_view text) {
  if (text.empty()) return kj::READY_NOW;
  const std::string_view piece = text.substr(0, kSendBytes);
  return timer->timeoutAfter(kSendTime, out->write(piece.data(), piece.size()))
      .then([timer, out, rest = text.substr(piece.size())] {
        return WriteInPieces(timer, out, rest);
      });
}

}  // namespace veduta
