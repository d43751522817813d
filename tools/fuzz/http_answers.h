// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a daemon promises of all that it sends over one connection of HTTP.

#include <algorithm>
#include <charconv>
#include <string>
#include <string_view>

#include "cli/wire/json.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

// A header of a head that begins and ends with a line's end; empty where it has none.
inline std::string_view HeaderIn(std::string_view head, const std::string& name) {
  const std::string begin = "\r\n" + name + ": ";
  const size_t at = head.find(begin);
  if (at == head.npos) return {};
  head.remove_prefix(at + begin.size());
  return head.substr(0, head.find("\r\n"));
}

// 0 where the text is no number.
inline uint64_t NumberIn(std::string_view text) {
  uint64_t number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

// The code of the first answer; 0 where there is none.
inline uint64_t CodeOf(std::string_view received) {
  return received.starts_with("HTTP/1.1 ") ? NumberIn(received.substr(9, 3)) : 0;
}

inline void CheckBody(uint64_t code, std::string_view head, std::string_view body) {
  if (!HeaderIn(head, "Content-Type").ends_with("json")) return;
  const Json json = Json::parse(body, nullptr, false);
  Expect(!json.is_discarded(), "what is said to be JSON is JSON");
  if (code >= 400)
    Expect(json.is_object() && json.value("status", Json()) == code && json.contains("detail"),
           "a problem has its code and says what is wrong");
}

// Checks the first answer, and takes it off. An answer to HEAD has no body, whatever its length is
// said to be.
inline void CheckAnswer(std::string_view* received) {
  const uint64_t code = CodeOf(*received);
  Expect(code >= 100 && code <= 599, "every answer begins with HTTP/1.1 and a code");
  Expect(code != 500, "no request makes the daemon fail");
  const size_t end = received->find("\r\n\r\n");
  Expect(end != received->npos, "every answer has a head that ends");
  const std::string_view head = received->substr(0, end + 2);
  Expect(code < 400 || HeaderIn(head, "Content-Type") == "application/problem+json",
         "every failure is a problem as RFC 9457 has it");
  received->remove_prefix(end + 4);
  const uint64_t length = NumberIn(HeaderIn(head, "Content-Length"));
  if (length == 0 || received->empty() || CodeOf(*received) != 0) return;
  Expect(received->size() >= length, "a body is sent to its end");
  CheckBody(code, head, received->substr(0, length));
  received->remove_prefix(length);
}

// All of them, up to one that tells events, which has no end.
inline void CheckAnswers(std::string_view received) {
  while (!received.empty()) {
    const std::string_view head = received.substr(0, received.find("\r\n\r\n"));
    if (CodeOf(received) == 200 && HeaderIn(head, "Content-Type") == "text/event-stream") return;
    CheckAnswer(&received);
  }
}

}  // namespace veduta::fuzz
