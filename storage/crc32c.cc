// SPDX-License-Identifier: Apache-2.0
#include "storage/crc32c.h"

#include <array>
#include <cstddef>
#include <cstring>

namespace veduta {
namespace {

constexpr uint32_t kReversedPolynomial =
    0x82f63b78u;  // 0x1edc6f41 of RFC 3720 with its bits turned
constexpr size_t kStride = 8;

using Tables = std::array<std::array<uint32_t, 256>, kStride>;

// tables[k][b] is the checksum of the byte b followed by k zeros (Kounavis and Berry, "A Systematic
// Approach to Building High Performance Software-based CRC Generators": slicing by eight).
constexpr Tables MakeTables() {
  Tables tables{};
  for (uint32_t byte = 0; byte < 256; ++byte) {
    uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? kReversedPolynomial : 0);
    tables[0][byte] = crc;
  }
  for (size_t k = 1; k < kStride; ++k) {
    for (size_t byte = 0; byte < 256; ++byte) {
      const uint32_t before = tables[k - 1][byte];
      tables[k][byte] = (before >> 8) ^ tables[0][before & 0xff];
    }
  }
  return tables;
}

constexpr Tables kTables = MakeTables();

}  // namespace

uint32_t ExtendCrc32c(uint32_t crc, std::string_view bytes) {
  crc = ~crc;
  while (bytes.size() >= kStride) {
    uint64_t word = 0;  // little-endian, as every processor that the project is built for
    std::memcpy(&word, bytes.data(), kStride);
    word ^= crc;
    crc = 0;
    for (size_t k = 0; k < kStride; ++k) crc ^= kTables[kStride - 1 - k][(word >> (8 * k)) & 0xff];
    bytes.remove_prefix(kStride);
  }
  for (const char c : bytes) crc = (crc >> 8) ^ kTables[0][(crc ^ static_cast<uint8_t>(c)) & 0xff];
  return ~crc;
}

}  // namespace veduta
