// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/json.h"

#include <cstdio>

namespace veduta {

// The library escapes U+0000 to U+001F. Terminals act on U+007F to U+009F too (ECMA-48, section
// 5.3), which stand in JSON inside of strings only.
std::string JsonLine(const Json& value) {
  const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string line;
  line.reserve(text.size());
  for (size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
    const bool is_c1 = byte == 0xC2 && next >= 0x80 && next < 0xA0;
    if (byte != 0x7F && !is_c1) {
      line += text[i];
      continue;
    }
    char escaped[7];
    std::snprintf(escaped, sizeof(escaped), "\\u%04x", is_c1 ? next : byte);
    line += escaped;
    i += is_c1;
  }
  return line;
}

}  // namespace veduta
