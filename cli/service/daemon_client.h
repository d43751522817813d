// SPDX-License-Identifier: Apache-2.0
#pragma once
// Asks the daemon that has a database open, for commands that would otherwise open it themselves.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cli/service/http_message.h"
#include "storage/base/status.h"

namespace veduta {

// One thread at a time, always the same one.
class DaemonClient final {
 public:
  // Nothing where no daemon has the database open.
  static std::optional<DaemonClient> Connect(const std::string& database);
  DaemonClient(DaemonClient&&) noexcept;
  DaemonClient& operator=(DaemonClient&&) noexcept;
  ~DaemonClient();

  struct Question {
    std::string method = "GET", path;  // with the query, percent-encoded
    std::string content_type;
    std::span<const uint8_t> body;
    bool prefers_async = false;
  };
  // Waits for the answer, whatever its code. kIoError where the daemon has gone.
  Result<HttpAnswer> Ask(const Question& question);

 private:
  struct Connection;
  explicit DaemonClient(std::unique_ptr<Connection> connection);
  std::unique_ptr<Connection> connection_;
};

// A value of a query, percent-encoded.
std::string EncodeForQuery(const std::string& text);

}  // namespace veduta
