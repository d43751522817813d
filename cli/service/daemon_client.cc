// SPDX-License-Identifier: Apache-2.0
#include "cli/service/daemon_client.h"

#include <kj/async-io.h>
#include <kj/compat/http.h>
#include <kj/encoding.h>

#include <limits>

#include "cli/service/own_socket.h"

namespace veduta {

struct DaemonClient::Connection {
  kj::AsyncIoContext io = kj::setupAsyncIo();
  kj::HttpHeaderTable::Builder builder;
  kj::HttpHeaderId prefer = builder.add("Prefer"), location = builder.add("Location"),
                   retry_after = builder.add("Retry-After");
  kj::Own<kj::HttpHeaderTable> table = builder.build();
  kj::Own<kj::AsyncIoStream> stream;
  kj::Own<kj::HttpClient> client;
};

DaemonClient::DaemonClient(std::unique_ptr<Connection> connection)
    : connection_(std::move(connection)) {}
DaemonClient::DaemonClient(DaemonClient&&) noexcept = default;
DaemonClient& DaemonClient::operator=(DaemonClient&&) noexcept = default;
DaemonClient::~DaemonClient() = default;

std::optional<DaemonClient> DaemonClient::Connect(const std::string& database) {
  std::optional<kj::AutoCloseFd> socket = ConnectToSocket(database);
  if (!socket) return std::nullopt;
  auto connection = std::make_unique<Connection>();
  connection->stream = connection->io.lowLevelProvider->wrapSocketFd(kj::mv(*socket));
  connection->client = kj::newHttpClient(*connection->table, *connection->stream);
  return DaemonClient(std::move(connection));
}

Result<HttpAnswer> DaemonClient::Ask(const Question& question) {
  Connection& c = *connection_;
  try {
    kj::HttpHeaders headers(*c.table);
    headers.set(kj::HttpHeaderId::HOST, "localhost");
    if (!question.content_type.empty())
      headers.set(kj::HttpHeaderId::CONTENT_TYPE, kj::str(question.content_type.c_str()));
    if (question.prefers_async) headers.set(c.prefer, "respond-async");
    const bool is_post = question.method == "POST";
    auto request = c.client->request(
        is_post ? kj::HttpMethod::POST : kj::HttpMethod::GET, question.path.c_str(), headers,
        is_post ? kj::Maybe<uint64_t>(question.body.size()) : kj::Maybe<uint64_t>(nullptr));
    if (is_post) {
      if (!question.body.empty())
        request.body->write(question.body.data(), question.body.size()).wait(c.io.waitScope);
      request.body = nullptr;
    }
    auto response = request.response.wait(c.io.waitScope);
    HttpAnswer answer;
    answer.code = response.statusCode;
    for (const auto& [id, name] :
         {std::pair(c.location, "Location"), std::pair(c.retry_after, "Retry-After")}) {
      KJ_IF_MAYBE (value, response.headers->get(id)) {
        answer.headers.emplace_back(name, std::string(value->cStr()));
      }
    }
    const kj::String body = response.body->readAllText().wait(c.io.waitScope);
    answer.body.assign(body.begin(), body.size());
    return answer;
  } catch (const kj::Exception& exception) {
    return Status::IoError(
        "the daemon does not answer any more (" + std::string(exception.getDescription().cStr()) +
        "): see whether it runs, and give the same command again; what was taken is kept");
  }
}

std::string EncodeForQuery(const std::string& text) {
  return kj::encodeUriComponent(kj::StringPtr(text.c_str(), text.size())).cStr();
}

}  // namespace veduta
