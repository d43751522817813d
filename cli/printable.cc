// SPDX-License-Identifier: Apache-2.0
#include "cli/printable.h"

#include <cstdint>
#include <cstdio>

namespace veduta {
namespace {

// How many bytes the character at the start of `text` has; 0 where no UTF-8 character starts: a
// stray or missing continuation byte, a longer form than needed, a surrogate, or a value above
// U+10FFFF (RFC 3629, section 4).
size_t CharacterBytes(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<uint8_t>(text[i]); };
  const uint8_t first = byte(0);
  if (first < 0x80) return 1;
  const size_t count = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < count) return 0;
  for (size_t i = 1; i < count; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const uint8_t second = byte(1);
  const bool too_long = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool surrogate = first == 0xED && second >= 0xA0;
  const bool too_large = first == 0xF4 && second >= 0x90;
  return too_long || surrogate || too_large ? 0 : count;
}

// U+0000 to U+001F, U+007F, and U+0080 to U+009F: terminals take the last ones for escape sequences
// too (ECMA-48, section 5.3).
bool IsControl(std::string_view character) {
  const auto first = static_cast<uint8_t>(character[0]);
  if (character.size() == 1) return first < 0x20 || first == 0x7F;
  return first == 0xC2 && static_cast<uint8_t>(character[1]) < 0xA0;
}

void AppendEscaped(std::string_view bytes, std::string* out) {
  for (const char byte : bytes) {
    if (byte == '\n') {
      *out += "\\n";
    } else if (byte == '\r') {
      *out += "\\r";
    } else if (byte == '\t') {
      *out += "\\t";
    } else {
      char escaped[5];
      std::snprintf(escaped, sizeof(escaped), "\\x%02x", static_cast<uint8_t>(byte));
      *out += escaped;
    }
  }
}

}  // namespace

std::string Printable(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const size_t count = CharacterBytes(text);
    const std::string_view character = text.substr(0, count == 0 ? 1 : count);
    if (count == 0 || IsControl(character)) {
      AppendEscaped(character, &out);
    } else {
      out += character;
    }
    text.remove_prefix(character.size());
  }
  return out;
}

std::string PrintableLines(std::string_view text) {
  std::string out;
  for (size_t end = 0; end != std::string_view::npos;) {
    end = text.find('\n');
    out += Printable(text.substr(0, end));
    if (end == std::string_view::npos) break;
    out += '\n';
    text.remove_prefix(end + 1);
  }
  return out;
}

}  // namespace veduta
