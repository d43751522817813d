// SPDX-License-Identifier: Apache-2.0
// Goal: a person reads which two reconstructions are not believed to be one, and why.
// Method: one hypothesis is printed, once as it is and once when it is due; standard output is
//   captured.
#include "cli/hypotheses.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(PrintHypothesis, SaysBothAndWhyOnOneLine) {
  HypothesisAnswer hypothesis;
  hypothesis.a = ReconstructionId(1);
  hypothesis.b = ReconstructionId(3);
  hypothesis.reason = "pairs contradict it: 4 agree";
  hypothesis.judgments = 2;
  testing::internal::CaptureStdout();
  PrintHypothesis(hypothesis);
  hypothesis.due = true;
  hypothesis.judgments = 1;
  PrintHypothesis(hypothesis);
  hypothesis.unsure = {ImageId(4)};
  PrintHypothesis(hypothesis);
  hypothesis.unsure = {ImageId(4), ImageId(7)};
  hypothesis.due = false;
  PrintHypothesis(hypothesis);
  EXPECT_EQ(testing::internal::GetCapturedStdout(),
            "  reconstructions 1 and 3 are not believed to be one: pairs contradict it: 4 agree; "
            "judged 2 times\n"
            "  reconstructions 1 and 3 are not believed to be one: pairs contradict it: 4 agree; "
            "judged once, and to be judged anew\n"
            "  reconstructions 1 and 3 are not believed to be one: pairs contradict it: 4 agree; "
            "judged once, and to be judged anew; 1 photo may stand on either side\n"
            "  reconstructions 1 and 3 are not believed to be one: pairs contradict it: 4 agree; "
            "judged once; 2 photos may stand on either side\n");
}

}  // namespace
}  // namespace veduta
