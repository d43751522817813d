// SPDX-License-Identifier: Apache-2.0
#pragma once
// The answer to one request on its way to the client: gets the request's id as a header, and may be
// the last one of its connection. The log is told when the answer has gone, or the client has.

#include <kj/compat/http.h>

#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include "cli/service/client_presence.h"
#include "cli/service/connection_closer.h"
#include "cli/service/request_log.h"

namespace veduta {

class LoggedResponse final : public kj::HttpService::Response {
 public:
  // `socket` is the connection's, which must outlive this, as the closer must.
  LoggedResponse(Response* response, int socket, std::string id,
                 std::function<void(const RequestEntry&)> told, ConnectionCloser* closer)
      : response_(*response),
        told_(std::move(told)),
        closer_(*closer),
        client_(std::make_shared<ClientPresence>(socket)) {
    entry_.id = std::move(id);
    entry_.door = "http";
    entry_.status = kClientGoneCode;
  }
  ~LoggedResponse() {
    client_->Leave();
    if (!told_) return;
    const std::chrono::duration<double, std::milli> took = Clock::now() - begun_;
    entry_.ms = took.count();
    told_(entry_);
  }
  LoggedResponse(const LoggedResponse&) = delete;
  LoggedResponse& operator=(const LoggedResponse&) = delete;

  bool is_told() const { return static_cast<bool>(told_); }
  RequestEntry& entry() { return entry_; }
  const std::shared_ptr<ClientPresence>& client() const { return client_; }
  // The client is told that this is the last answer of the connection. To be called before it is.
  void CloseAfter() { is_last_ = true; }

  kj::Own<kj::AsyncOutputStream> send(kj::uint code, kj::StringPtr phrase,
                                      const kj::HttpHeaders& headers,
                                      kj::Maybe<uint64_t> size = nullptr) override {
    entry_.status = code;
    KJ_IF_MAYBE (bytes, size) {
      entry_.bytes = *bytes;
    }
    kj::HttpHeaders with_id = headers.cloneShallow();
    with_id.add("X-Request-Id"_kj, kj::StringPtr(entry_.id.c_str()));
    if (is_last_) closer_.CloseAfterNext();
    return response_.send(code, phrase, with_id, size);
  }
  kj::Own<kj::WebSocket> acceptWebSocket(const kj::HttpHeaders& headers) override {
    return response_.acceptWebSocket(headers);
  }

 private:
  using Clock = std::chrono::steady_clock;
  Response& response_;
  const std::function<void(const RequestEntry&)> told_;
  ConnectionCloser& closer_;
  const std::shared_ptr<ClientPresence> client_;
  const Clock::time_point begun_ = Clock::now();
  RequestEntry entry_;
  bool is_last_ = false;
};

}  // namespace veduta
