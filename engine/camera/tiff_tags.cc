// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/tiff_tags.h"

namespace veduta {
namespace {

constexpr size_t kEntrySize = 12;  // tag, type: 2 bytes each; count, value: 4 bytes each
constexpr uint32_t kTypeShort = 3;
constexpr uint32_t kTypeLong = 4;

// Callers stay within `bytes`.
struct Reader {
  std::span<const uint8_t> bytes;
  bool is_little_endian = false;

  uint32_t Short(size_t at) const {
    const uint32_t first = bytes[at], second = bytes[at + 1];
    return is_little_endian ? second << 8 | first : first << 8 | second;
  }
  uint32_t Long(size_t at) const {
    const uint32_t first = Short(at), second = Short(at + 2);
    return is_little_endian ? second << 16 | first : first << 16 | second;
  }
};

}  // namespace

std::optional<TiffTags> ReadTiffTags(std::span<const uint8_t> bytes) {
  if (bytes.size() < 8 || bytes[0] != bytes[1] || (bytes[0] != 'I' && bytes[0] != 'M'))
    return std::nullopt;
  const Reader reader{bytes, bytes[0] == 'I'};
  if (reader.Short(2) != 42) return std::nullopt;
  const size_t directory = reader.Long(4);
  if (directory < 8 || directory > bytes.size() - 2) return std::nullopt;
  const size_t entry_count = reader.Short(directory);
  if (entry_count * kEntrySize > bytes.size() - 2 - directory) return std::nullopt;
  TiffTags tags;
  for (size_t i = 0; i < entry_count; ++i) {
    const size_t entry = directory + 2 + i * kEntrySize;
    const uint32_t type = reader.Short(entry + 2);
    if ((type != kTypeShort && type != kTypeLong) || reader.Long(entry + 4) != 1) continue;
    const uint32_t value = type == kTypeShort ? reader.Short(entry + 8) : reader.Long(entry + 8);
    const auto set = [value](std::optional<uint32_t>& tag) {
      if (!tag) tag = value;
    };
    switch (reader.Short(entry)) {
      case 256:
        set(tags.width_px);
        break;
      case 257:
        set(tags.height_px);
        break;
      case 274:
        set(tags.orientation);
        break;
      default:
        break;
    }
  }
  return tags;
}

}  // namespace veduta
