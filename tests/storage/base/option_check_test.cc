// SPDX-License-Identifier: Apache-2.0
// Goal: a violated bound is named with its value and its range, whatever the number's type.
// Method: numbers of each kind, among them those that lose digits in a fixed-point text, and NaN.
#include "storage/base/option_check.h"

#include <gtest/gtest.h>

#include <limits>

namespace veduta {
namespace {

TEST(OptionCheck, NamesValueAndRange) {
  EXPECT_TRUE(CheckOption(true, "share", 0.5, "(0, 1]").ok());
  const Status status = CheckOption(false, "share", 1.5, "(0, 1]");
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "share is 1.5; it must be in (0, 1]");
  EXPECT_EQ(CheckOption(false, "count", 7u, "[8, 9]").message(),
            "count is 7; it must be in [8, 9]");
  EXPECT_EQ(CheckOption(false, "penalty", uint8_t{200}, "[0, 128]").message(),
            "penalty is 200; it must be in [0, 128]");
}

TEST(OptionCheck, KeepsTheDigitsOfSmallNumbers) {
  EXPECT_EQ(OptionText(1e-9), "1e-09");
  EXPECT_EQ(OptionText(-0.00012345), "-0.00012345");
  EXPECT_EQ(OptionText(0.5f), "0.5");
  EXPECT_EQ(OptionText(std::numeric_limits<double>::quiet_NaN()), "nan");
}

}  // namespace
}  // namespace veduta
