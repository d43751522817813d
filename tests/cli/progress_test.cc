// SPDX-License-Identifier: Apache-2.0
// Goal: the progress of a long command is told in whole lines where standard error is no terminal,
//   and its numbers are right at the beginning, on the way and at the end.
// Method: the texts of given states; what a Progress prints into a captured standard error.
#include "cli/progress.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(ProgressLine, TellsRateAndTimeLeft) {
  EXPECT_EQ(ProgressLine({3, 12, 2, "photos", ""}), "3 of 12 photos, 1.50 a second, 0:06 left");
  EXPECT_EQ(ProgressLine({1, 3601, 1, "photos", ""}),
            "1 of 3601 photos, 1.00 a second, 1:00:00 left");
  EXPECT_EQ(ProgressLine({12, 12, 8, "depth maps", ""}),
            "12 of 12 depth maps, 1.50 a second, 0:00 left");
}

TEST(ProgressLine, KnowsNoTimeBeforeTheFirst) {
  EXPECT_EQ(ProgressLine({0, 12, 5, "photos", ""}), "0 of 12 photos, 0.00 a second, ? left");
  EXPECT_EQ(ProgressLine({0, 0, 0, "photos", ""}), "0 of 0 photos, 0.00 a second, ? left");
}

TEST(ProgressLine, MoreThanExpectedIsNoTimeLeft) {
  EXPECT_EQ(ProgressLine({13, 12, 13, "tiles", ""}), "13 of 12 tiles, 1.00 a second, 0:00 left");
}

TEST(ProgressBar, IsFilledByItsShare) {
  const std::string half(15, '#'), rest(15, '.');
  EXPECT_EQ(ProgressBar({6, 12, 3, "photos", "placed"}),
            "[" + half + rest + "] 6/12  2.00/s  0:03 left  placed");
  EXPECT_EQ(ProgressBar({0, 12, 0, "photos", ""}).find('#'), std::string::npos);
  for (const size_t done : {12, 13}) {
    EXPECT_EQ(ProgressBar({done, 12, 3, "photos", ""}).substr(0, 32),
              "[" + std::string(30, '#') + "]");
  }
}

TEST(TextOfCounts, HasEachWordOnce) {
  EXPECT_EQ(TextOfCounts({{"postponed", 1}, {"placed", 9}}), "9 placed, 1 postponed");
  EXPECT_EQ(TextOfCounts({}), "");
}

TEST(Progress, SaysNothingTooOftenAndTheEndAlways) {
  testing::internal::CaptureStderr();
  {
    Progress progress(3, "pieces");
    progress.Advance("placed");
    progress.Say("a word");
    progress.Set(2);
    progress.Advance("placed");
  }
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(said.find("a word\n3 of 3 pieces, "), 0u) << said;
  EXPECT_EQ(said.find('\r'), std::string::npos);
  EXPECT_EQ(said.back(), '\n');
}

}  // namespace
}  // namespace veduta
