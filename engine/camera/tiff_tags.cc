// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/tiff_tags.h"

#include <algorithm>
#include <array>
#include <utility>

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

  // The places of the entries of the directory that begins there; none where it is not within the
  // bytes.
  std::vector<size_t> Entries(size_t directory) const {
    std::vector<size_t> entries;
    if (directory < 8 || directory > bytes.size() - 2) return entries;
    const size_t count = Short(directory);
    if (count * kEntrySize > bytes.size() - 2 - directory) return entries;
    for (size_t i = 0; i < count; ++i) entries.push_back(directory + 2 + i * kEntrySize);
    return entries;
  }
};

std::optional<Reader> Open(std::span<const uint8_t> bytes) {
  if (bytes.size() < 8 || bytes[0] != bytes[1] || (bytes[0] != 'I' && bytes[0] != 'M'))
    return std::nullopt;
  const Reader reader{bytes, bytes[0] == 'I'};
  return reader.Short(2) == 42 ? std::optional(reader) : std::nullopt;
}

// Directories and values with the byte order that was read, one after the other.
class Writer {
 public:
  explicit Writer(const Reader& from) : from_(from) {
    block_.assign(from.bytes.begin(), from.bytes.begin() + 4);
    block_.resize(8);
    PutLong(4, 8);
  }

  // The entries of the directory there, and of those that it leads to: two at most, however often
  // it names them. Returns where it was put.
  size_t PutDirectory(size_t directory) {
    std::vector<size_t> entries = from_.Entries(directory);
    std::erase_if(entries, [this](size_t entry) { return !IsKept(entry); });
    if (entries.size() > kEntriesMax) entries.resize(kEntriesMax);
    const size_t at = block_.size();
    block_.resize(at + 2 + entries.size() * kEntrySize + 4);
    PutShort(at, static_cast<uint32_t>(entries.size()));
    for (size_t i = 0; i < entries.size(); ++i) {
      const size_t entry = entries[i], put = at + 2 + i * kEntrySize;
      std::copy_n(from_.bytes.begin() + static_cast<ptrdiff_t>(entry), kEntrySize,
                  block_.begin() + static_cast<ptrdiff_t>(put));
      if (LeadsOn(entry)) {
        const bool is_followed = followed_ < kFollowedMax;
        if (is_followed) ++followed_;
        const size_t next = is_followed ? PutDirectory(from_.Long(entry + 8)) : 0;
        PutLong(put + 8, static_cast<uint32_t>(next));
      } else if (SizeOf(entry) > 4) {
        PutLong(put + 8, static_cast<uint32_t>(block_.size()));
        const auto value = from_.bytes.begin() + static_cast<ptrdiff_t>(from_.Long(entry + 8));
        block_.insert(block_.end(), value, value + static_cast<ptrdiff_t>(SizeOf(entry)));
        block_.resize(block_.size() + block_.size() % 2);
      }
    }
    return at;
  }
  std::vector<uint8_t> Take() { return std::move(block_); }

 private:
  static constexpr uint64_t kValueSizeMax = 256;
  static constexpr size_t kEntriesMax = 80;  // so that three directories have less than 64 KiB
  static constexpr int kFollowedMax = 2;

  // Without what leads to other places, as makers' own notes and previews.
  bool IsKept(size_t entry) const {
    const uint32_t tag = from_.Short(entry);
    return tag != 330 && tag != 37500 && tag != 40965 && SizeOf(entry) <= kValueSizeMax;
  }
  bool LeadsOn(size_t entry) const {
    const uint32_t tag = from_.Short(entry);
    return tag == 34665 || tag == 34853;
  }
  // Of the value in bytes; more than any may have where it is not within the bytes, or of a type
  // that there is not.
  uint64_t SizeOf(size_t entry) const {
    constexpr std::array<uint64_t, 13> kSizes = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
    const uint32_t type = from_.Short(entry + 2);
    if (type == 0 || type >= kSizes.size()) return kValueSizeMax + 1;
    const uint64_t size = kSizes[type] * from_.Long(entry + 4);
    const bool is_inside = size <= 4 || from_.Long(entry + 8) + size <= from_.bytes.size();
    return is_inside ? size : kValueSizeMax + 1;
  }
  void PutShort(size_t at, uint32_t number) {
    block_[at + (from_.is_little_endian ? 0 : 1)] = static_cast<uint8_t>(number);
    block_[at + (from_.is_little_endian ? 1 : 0)] = static_cast<uint8_t>(number >> 8);
  }
  void PutLong(size_t at, uint32_t number) {
    PutShort(at + (from_.is_little_endian ? 0 : 2), number & 0xFFFF);
    PutShort(at + (from_.is_little_endian ? 2 : 0), number >> 16);
  }

  const Reader& from_;
  int followed_ = 0;
  std::vector<uint8_t> block_;
};

}  // namespace

std::vector<uint8_t> ExifOfTiff(std::span<const uint8_t> bytes) {
  const std::optional<Reader> reader = Open(bytes);
  if (!reader) return {};
  Writer writer(*reader);
  writer.PutDirectory(reader->Long(4));
  return writer.Take();
}

std::optional<TiffTags> ReadTiffTags(std::span<const uint8_t> bytes) {
  const std::optional<Reader> opened = Open(bytes);
  if (!opened) return std::nullopt;
  const Reader& reader = *opened;
  const size_t directory = reader.Long(4);
  if (directory < 8 || directory > bytes.size() - 2) return std::nullopt;
  if (reader.Short(directory) * kEntrySize > bytes.size() - 2 - directory) return std::nullopt;
  TiffTags tags;
  for (const size_t entry : reader.Entries(directory)) {
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
