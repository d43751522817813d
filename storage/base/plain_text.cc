// SPDX-License-Identifier: Apache-2.0
#include "storage/base/plain_text.h"

#include <cstddef>
#include <cstdint>

namespace veduta {
namespace {

// The smallest code points that take 2, 3 and 4 bytes.
constexpr uint32_t kSmallest[] = {0x80, 0x800, 0x10000};
constexpr uint32_t kLast = 0x10FFFF;

// Takes one character off the front; 0xFFFFFFFF where it is none.
uint32_t TakeCharacter(std::string_view* text) {
  constexpr uint32_t kNone = 0xFFFFFFFF;
  const auto first = static_cast<uint8_t>(text->front());
  const size_t length = first < 0x80   ? 1
                        : first < 0xC0 ? 0
                        : first < 0xE0 ? 2
                        : first < 0xF0 ? 3
                                       : 4;
  if (length == 0 || length > text->size() || first > 0xF4) return kNone;
  uint32_t point = length == 1 ? first : first & (0xFFu >> (length + 1));
  for (size_t i = 1; i < length; ++i) {
    const auto next = static_cast<uint8_t>((*text)[i]);
    if ((next & 0xC0) != 0x80) return kNone;
    point = point << 6 | (next & 0x3Fu);
  }
  text->remove_prefix(length);
  if (length > 1 && point < kSmallest[length - 2]) return kNone;
  return point > kLast || (point >= 0xD800 && point <= 0xDFFF) ? kNone : point;
}

}  // namespace

bool IsPlainText(std::string_view text, bool may_have_lines) {
  while (!text.empty()) {
    const uint32_t point = TakeCharacter(&text);
    const bool is_control = point < 0x20 || (point >= 0x7F && point < 0xA0);
    if (point > kLast || (is_control && !(may_have_lines && point == '\n'))) return false;
  }
  return true;
}

}  // namespace veduta
