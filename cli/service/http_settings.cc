// SPDX-License-Identifier: Apache-2.0
#include "cli/service/http_settings.h"

namespace veduta {
namespace {

// How long a client may take for the head of a request.
constexpr kj::Duration kHeadTime = 15 * kj::SECONDS;
// How long the rest of a body is read that was refused.
constexpr kj::Duration kRefusedTime = 10 * kj::SECONDS;
// How long a connection may rest between two requests.
constexpr kj::Duration kRestTime = 60 * kj::SECONDS;

// A client that breaks the protocol when it has been answered loses its connection, and fills no
// log: by default kj writes a line of its own for each.
class QuietErrors final : public kj::HttpServerErrorHandler {
 public:
  kj::Promise<void> handleApplicationError(
      kj::Exception exception, kj::Maybe<kj::HttpService::Response&> response) override {
    if (response == nullptr) return kj::READY_NOW;
    return kj::HttpServerErrorHandler::handleApplicationError(kj::mv(exception), response);
  }
};

}  // namespace

kj::HttpServerSettings HttpSettings(uint64_t body_bytes_max) {
  static QuietErrors errors;  // it has no state, so all threads may share it
  kj::HttpServerSettings settings;
  settings.headerTimeout = kHeadTime;
  settings.pipelineTimeout = kRestTime;
  // Clients read why a body was refused when they have sent all of it.
  settings.canceledUploadGraceBytes = body_bytes_max;
  settings.canceledUploadGracePeriod = kRefusedTime;
  settings.errorHandler = errors;
  return settings;
}

}  // namespace veduta
