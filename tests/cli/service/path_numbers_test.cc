// SPDX-License-Identifier: Apache-2.0
// Goal: only whole numbers in their bounds are numbers.
// Method: right ones, and texts that are almost one.
#include "cli/service/path_numbers.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(PathNumbers, AreWholeAndInBounds) {
  EXPECT_EQ(*WholeNumber("it", "0", 0, 5), 0u);
  EXPECT_EQ(*WholeNumber("it", "7", 7, 7), 7u);
  EXPECT_EQ(ReconstructionNumber("4294967295")->value, 4294967295u);
  EXPECT_EQ(*UploadNumber("18446744073709551615"), 18446744073709551615u);
  EXPECT_EQ(*ContributionNumber("4294967295"), 4294967295u);
  for (const char* text : {"", "0", "-1", "+1", " 1", "1 ", "1x", "0x1", "4294967296", "1e3", "1.0",
                           "99999999999999999999"}) {
    EXPECT_EQ(ReconstructionNumber(text).status().code(), StatusCode::kInvalidArgument) << text;
    EXPECT_EQ(ContributionNumber(text).status().code(), StatusCode::kInvalidArgument) << text;
  }
  EXPECT_FALSE(UploadNumber("18446744073709551616").ok());
  EXPECT_NE(WholeNumber("the parameter 'n'", "9", 1, 5).status().message().find("from 1 to 5"),
            std::string::npos);
}

}  // namespace
}  // namespace veduta
