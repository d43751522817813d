// SPDX-License-Identifier: Apache-2.0
// Goal: Printable leaves readable text alone and lets nothing through that a terminal acts on.
// Method: texts with their expected form; all single bytes and all two-byte texts; random bytes.
#include "cli/printable.h"

#include <gtest/gtest.h>

#include <random>

namespace veduta {
namespace {

bool IsSafe(const std::string& text) {
  for (size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<uint8_t>(text[i]);
    if (byte < 0x20 || byte == 0x7F) return false;
    if (byte == 0xC2 && (i + 1 == text.size() || static_cast<uint8_t>(text[i + 1]) < 0xA0)) {
      return false;
    }
  }
  return Printable(text) == text;
}

TEST(Printable, LeavesReadableTextAlone) {
  for (const char* text : {"", "a.jpg", "a folder/b c.jpg", "\\n 'quoted' \"twice\"",
                           "caf\xc3\xa9 \xe4\xb8\xad \xf0\x9f\x8f\xa0", "\xc2\xa0\xef\xbf\xbd"}) {
    EXPECT_EQ(Printable(text), text);
  }
}

TEST(Printable, EscapesWhatATerminalActsOn) {
  EXPECT_EQ(Printable("a\nb\r\tc"), R"(a\nb\r\tc)");
  EXPECT_EQ(Printable("\x1b[31mred\x07\x7f"), R"(\x1b[31mred\x07\x7f)");
  EXPECT_EQ(Printable(std::string_view("a\0b", 3)), R"(a\x00b)");
  EXPECT_EQ(Printable("\xc2\x9b"
                      "31m"),
            R"(\xc2\x9b31m)");  // CSI as one character
}

TEST(Printable, EscapesWhatIsNotUtf8) {
  EXPECT_EQ(Printable("caf\xe9.jpg"), R"(caf\xe9.jpg)");
  EXPECT_EQ(Printable("\xc3"), R"(\xc3)");  // cut off
  EXPECT_EQ(Printable("\xe4\xb8"
                      "a"),
            R"(\xe4\xb8a)");                                // cut off by another character
  EXPECT_EQ(Printable("\xc0\x8a"), R"(\xc0\x8a)");          // a line's end in two bytes
  EXPECT_EQ(Printable("\xe0\x80\x8a"), R"(\xe0\x80\x8a)");  // and in three
  EXPECT_EQ(Printable("\xf0\x80\x80\x8a"), R"(\xf0\x80\x80\x8a)");
  EXPECT_EQ(Printable("\xed\xa0\x80"), R"(\xed\xa0\x80)");          // half of a surrogate pair
  EXPECT_EQ(Printable("\xf4\x90\x80\x80"), R"(\xf4\x90\x80\x80)");  // above U+10FFFF
}

TEST(Printable, LineEndsOfSeveralLinesStay) {
  EXPECT_EQ(PrintableLines(""), "");
  EXPECT_EQ(PrintableLines("a\x1b[2J\n\nb\r\n"), "a\\x1b[2J\n\nb\\r\n");
  EXPECT_EQ(PrintableLines("no end"), "no end");
}

TEST(Printable, IsSafeForAnyBytes) {
  std::mt19937 random(1);
  for (int first = 0; first < 256; ++first) {
    for (int second = -1; second < 256; ++second) {
      std::string text(1, static_cast<char>(first));
      if (second >= 0) text += static_cast<char>(second);
      EXPECT_TRUE(IsSafe(Printable(text))) << first << " " << second;
    }
    std::string text(50, ' ');
    for (char& byte : text) byte = static_cast<char>(random());
    EXPECT_TRUE(IsSafe(Printable(text)));
  }
}

}  // namespace
}  // namespace veduta
