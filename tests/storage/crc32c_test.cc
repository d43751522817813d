// SPDX-License-Identifier: Apache-2.0
// Goal: the checksum is CRC-32C, however its bytes are cut.
// Method: the published values of RFC 3720 (appendix B.4) and of the catalogue's check string.
#include "storage/crc32c.h"

#include <gtest/gtest.h>

#include <string>

namespace veduta {
namespace {

TEST(Crc32c, PublishedValues) {
  EXPECT_EQ(ExtendCrc32c(0, "123456789"), 0xe3069283u);
  EXPECT_EQ(ExtendCrc32c(0, std::string(32, '\0')), 0x8a9136aau);
  EXPECT_EQ(ExtendCrc32c(0, std::string(32, '\xff')), 0x62a8ab43u);
  std::string ascending;
  for (char c = 0; c < 32; ++c) ascending.push_back(c);
  EXPECT_EQ(ExtendCrc32c(0, ascending), 0x46dd794eu);
  EXPECT_EQ(ExtendCrc32c(0, ""), 0u);
}

TEST(Crc32c, PiecesGiveTheChecksumOfTheWhole) {
  const std::string text = "The quick brown fox jumps over the lazy dog, and back again.";
  const uint32_t whole = ExtendCrc32c(0, text);
  for (size_t cut = 0; cut <= text.size(); ++cut) {
    const uint32_t front = ExtendCrc32c(0, std::string_view(text).substr(0, cut));
    EXPECT_EQ(ExtendCrc32c(front, std::string_view(text).substr(cut)), whole) << cut;
  }
}

}  // namespace
}  // namespace veduta
