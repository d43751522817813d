// SPDX-License-Identifier: Apache-2.0
#pragma once
// The layout of RocksDB's write-ahead log, which LevelDB's doc/log_format.md explains. A log is a
// run of blocks of 32 KiB. A block holds fragments, and fewer than 7 bytes of filling at its end:
//
//   fragment := masked CRC-32C of type and data u32 | length u16 | type u8 | data u8[length]
//
// A record is one full fragment, or a first one, any number of middle ones and a last one. A record
// of the write-ahead log is a batch:
//
//   batch := sequence u64 | count u32 | the writes
//
// Its writes have the numbers sequence, sequence + 1 and so on.
//
// All numbers are little-endian. Types 5 to 8 belong to logs that are used again, which this
// project does not do (DBOptions::recycle_log_file_num is 0).

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "storage/crc32c.h"

namespace veduta {

enum class FragmentType : uint8_t { kNothing = 0, kFull = 1, kFirst = 2, kMiddle = 3, kLast = 4 };

inline constexpr size_t kLogBlockBytes = 32768;
inline constexpr size_t kFragmentHeaderBytes = 7;
inline constexpr size_t kBatchHeaderBytes = 12;

// The number at the front of `bytes`, which has enough of them.
template <typename Number>
Number LittleEndianAt(std::string_view bytes, size_t offset) {
  Number number = 0;
  for (size_t i = 0; i < sizeof(Number); ++i)
    number |= static_cast<Number>(static_cast<uint8_t>(bytes[offset + i])) << (8 * i);
  return number;
}

template <typename Number>
void AppendLittleEndian(Number number, std::string* bytes) {
  for (size_t i = 0; i < sizeof(Number); ++i)
    bytes->push_back(static_cast<char>((number >> (8 * i)) & 0xff));
}

inline uint32_t FragmentChecksum(FragmentType type, std::string_view data) {
  const char byte = static_cast<char>(type);
  return MaskCrc32c(ExtendCrc32c(ExtendCrc32c(0, std::string_view(&byte, 1)), data));
}

}  // namespace veduta
