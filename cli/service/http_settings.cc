// SPDX-License-Identifier: Apache-2.0
#include "cli/service/http_settings.h"

#include <string>
#include <string_view>

#include "cli/service/http_message.h"

namespace veduta {
namespace {

// How long a client may take for the head of a request.
constexpr kj::Duration kHeadTime = 15 * kj::SECONDS;
// How long the rest of a body is read that was refused.
constexpr kj::Duration kRefusedTime = 10 * kj::SECONDS;
// How long a connection may rest between two requests.
constexpr kj::Duration kRestTime = 60 * kj::SECONDS;

kj::Promise<void> Tell(kj::HttpService::Response& response, uint32_t code,
                       const std::string& detail) {
  auto answer = kj::heap<HttpAnswer>(Problem(code, detail));
  const kj::HttpHeaderTable table;
  kj::HttpHeaders headers(table);
  headers.set(kj::HttpHeaderId::CONTENT_TYPE, kj::StringPtr(answer->content_type.c_str()));
  headers.add("Cache-Control"_kj, "no-cache"_kj);
  headers.add("X-Content-Type-Options"_kj, "nosniff"_kj);
  auto stream = response.send(code, HttpPhrase(code), headers, answer->body.size());
  auto sent = stream->write(answer->body.data(), answer->body.size());
  return sent.attach(kj::mv(stream), kj::mv(answer));
}

// Whether kj itself has failed on the request, as where its length is told twice.
bool IsOfHttp(const kj::Exception& exception) {
  return exception.getType() == kj::Exception::Type::FAILED &&
         std::string_view(exception.getFile()).ends_with("http.c++");
}

// A client that breaks the protocol is told so as others are of their failures. One that was
// answered already loses its connection, and fills no log: by default kj writes a line of its own
// for each. No text of an exception is told, since it names what is within the daemon.
class QuietErrors final : public kj::HttpServerErrorHandler {
 public:
  kj::Promise<void> handleClientProtocolError(kj::HttpHeaders::ProtocolError error,
                                              kj::HttpService::Response& response) override {
    const uint32_t code = error.statusCode == 501 ? 501 : 400;
    return Tell(response, code,
                code == 501 ? "the method is none that the daemon knows"
                            : "the head of the request is no HTTP, or is too large");
  }
  kj::Promise<void> handleApplicationError(
      kj::Exception exception, kj::Maybe<kj::HttpService::Response&> response) override {
    // Who has gone hears nothing.
    if (exception.getType() == kj::Exception::Type::DISCONNECTED) return kj::READY_NOW;
    KJ_IF_MAYBE (open, response) {
      if (IsOfHttp(exception))
        return Tell(*open, 400, "the length of the body cannot be told by the request's headers");
      const bool is_overload = exception.getType() == kj::Exception::Type::OVERLOADED;
      return Tell(*open, is_overload ? 503 : 500, "the daemon has failed on this request");
    }
    return kj::READY_NOW;
  }
  kj::Promise<void> handleNoResponse(kj::HttpService::Response& response) override {
    return Tell(response, 500, "the daemon has no answer to this request");
  }
};

}  // namespace

kj::HttpServerSettings HttpSettings(uint64_t body_bytes_max, kj::HttpServerCallbacks* callbacks) {
  static QuietErrors errors;  // it has no state, so all threads may share it
  kj::HttpServerSettings settings;
  settings.headerTimeout = kHeadTime;
  settings.pipelineTimeout = kRestTime;
  // Clients read why a body was refused when they have sent all of it.
  settings.canceledUploadGraceBytes = body_bytes_max;
  settings.canceledUploadGracePeriod = kRefusedTime;
  settings.errorHandler = errors;
  settings.callbacks = *callbacks;
  return settings;
}

}  // namespace veduta
