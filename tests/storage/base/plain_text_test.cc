// SPDX-License-Identifier: Apache-2.0
// Goal: text of strangers is UTF-8 without control characters, or is refused.
// Method: the borders of every length that a character may have, overlong forms, surrogates, text
//   that is cut short; every single byte and every pair of bytes against the rules written down
//   once more.
#include "storage/base/plain_text.h"

#include <gtest/gtest.h>

#include <string>

namespace veduta {
namespace {

TEST(PlainText, TakesWhatPeopleWrite) {
  for (const char* const text :
       {"", "a", "Straße 7/IMG 1.jpg", "\u00a0", "\u07ff", "\u0800", "\ud7ff", "\ue000", "\uffff",
        "\U00010000", "\U0010ffff", "\U0001f3db"})
    EXPECT_TRUE(IsPlainText(text, false)) << text;
}

TEST(PlainText, RefusesControlCharacters) {
  for (int c = 0; c < 0x20; ++c) {
    const std::string text(1, static_cast<char>(c));
    EXPECT_FALSE(IsPlainText(text, false)) << c;
    EXPECT_EQ(IsPlainText(text, true), c == '\n') << c;
  }
  for (const char* const text : {"\x7f", "\xc2\x80", "\xc2\x9f"})
    EXPECT_FALSE(IsPlainText(text, true));
}

TEST(PlainText, RefusesWhatIsNoUtf8) {
  for (const char* const text : {"\x80",
                                 "\xbf",
                                 "\xff",
                                 "\xfe",
                                 "\xc0\xaf",
                                 "\xc1\xbf",
                                 "\xe0\x80\xaf",
                                 "\xe0\x9f\xbf",
                                 "\xf0\x80\x80\xaf",
                                 "\xf0\x8f\xbf\xbf",
                                 "\xed\xa0\x80",
                                 "\xed\xbf\xbf",
                                 "\xf4\x90\x80\x80",
                                 "\xf5\x80\x80\x80",
                                 "\xc3",
                                 "\xe2\x82",
                                 "\xf0\x9f\x8f",
                                 "\xc3\xc3",
                                 "a\xc3",
                                 "\xe2\x82"
                                 "a"})
    EXPECT_FALSE(IsPlainText(text, true));
}

TEST(PlainText, KnowsEveryPairOfBytes) {
  for (int a = 0; a < 256; ++a) {
    for (int b = 0; b < 256; ++b) {
      const std::string text = {static_cast<char>(a), static_cast<char>(b)};
      const auto is_ascii = [](int c) { return c >= 0x20 && c < 0x7f; };
      const bool is_two_bytes =
          a >= 0xc2 && a <= 0xdf && b >= 0x80 && b <= 0xbf && !(a == 0xc2 && b < 0xa0);
      EXPECT_EQ(IsPlainText(text, false), (is_ascii(a) && is_ascii(b)) || is_two_bytes)
          << a << " " << b;
    }
  }
}

}  // namespace
}  // namespace veduta
