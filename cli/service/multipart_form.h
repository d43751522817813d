// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bodies of the type multipart/form-data (RFC 7578), as a plain HTML form and `curl -F` send them.
// All of it comes from strangers.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

// The most that a form may have. Chosen by hand: browsers write a few hundred bytes for each part.
inline constexpr size_t kFormPartsMax = 128, kFormHeadBytesMax = 4096, kFormHeadLinesMax = 16;

struct FormPart {
  std::string name;           // of the field
  std::string file_name;      // as it was sent: it may be anything; empty: none
  bool is_file = false;       // it has a file name, which may be empty
  size_t begin = 0, end = 0;  // its bytes within the body
};

// `content_type` is the header, with the boundary. Strict: what is not as the RFC has it is refused
// rather than guessed at, and so are forms within parts. kInvalidArgument names what is wrong.
// O(body).
Result<std::vector<FormPart>> ParseForm(std::span<const uint8_t> body,
                                        const std::string& content_type);

}  // namespace veduta
