// SPDX-License-Identifier: Apache-2.0
#pragma once
// A part of an answer's bytes, for who goes on where a download broke off (RFC 9110, section 14).

#include <string>

#include "cli/service/http_message.h"

namespace veduta {

// Makes of the whole answer to a GET what the header `Range` asks for: 206 with one range of bytes,
// or 416 where it has no such bytes. It stays as it is where the header is empty, or broken, or
// asks for several ranges, and where `if_range`, unless empty, is not its ETag, a strong one. JSON
// is told whole.
void CutToRange(const std::string& range, const std::string& if_range, HttpAnswer* answer);

}  // namespace veduta
