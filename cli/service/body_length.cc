// SPDX-License-Identifier: Apache-2.0
#include "cli/service/body_length.h"

#include <charconv>
#include <cstdint>

namespace veduta {

std::optional<HttpAnswer> RefuseLength(const kj::HttpHeaders& headers) {
  KJ_IF_MAYBE (length, headers.get(kj::HttpHeaderId::CONTENT_LENGTH)) {
    if (ComesInChunks(headers))
      return Problem(400, "a request may not have both Content-Length and Transfer-Encoding");
    uint64_t bytes = 0;  // digits alone: no sign, no space
    const auto [rest, error] = std::from_chars(length->begin(), length->end(), bytes);
    if (error != std::errc() || rest != length->end())
      return Problem(400, "the Content-Length is no number of bytes");
  }
  return std::nullopt;
}

bool ComesInChunks(const kj::HttpHeaders& headers) {
  return headers.get(kj::HttpHeaderId::TRANSFER_ENCODING) != nullptr;
}

}  // namespace veduta
