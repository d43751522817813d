// SPDX-License-Identifier: Apache-2.0
// Goal: what is hidden and reported has the keys that docs/json.md lists, in one order, with null
//   for what there is none of.
// Method: answers of the door with known values, as text.
#include "cli/wire/moderation_json.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(ModerationJson, HasEveryKey) {
  EXPECT_EQ(JsonLine(ToJson(HiddenAnswer{HiddenKind::kImage, 4, "a.jpg", 5, "kai", "asked"})),
            R"({"id":4,"image":"a.jpg","contribution":null,"time":5,"actor":"kai",)"
            R"("reason":"asked"})");
  EXPECT_EQ(JsonLine(ToJson(HiddenAnswer{HiddenKind::kContribution, 4, "", 5, "kai", ""})),
            R"({"id":null,"image":null,"contribution":4,"time":5,"actor":"kai","reason":""})");
  ReportAnswer report;
  report.number = 3;
  report.image = ImageId(7);
  report.name = "a.jpg";
  report.reason = ReportReason::kPrivacy;
  report.text = "my window";
  report.reporter = "vera";
  report.time_unix_s = 9;
  EXPECT_EQ(JsonLine(ToJson(report)),
            R"({"report":3,"id":7,"image":"a.jpg","reason":"privacy","text":"my window",)"
            R"("reporter":"vera","time":9,"state":"open","resolver":null,"resolved":null})");
  report.name.clear();
  report.text.clear();
  report.state = ReportState::kErased;
  report.resolver = "ada";
  report.resolved_unix_s = 11;
  EXPECT_EQ(JsonLine(ToJson(report)),
            R"({"report":3,"id":7,"image":null,"reason":"privacy","text":"","reporter":"vera",)"
            R"("time":9,"state":"erased","resolver":"ada","resolved":11})");
}

TEST(ModerationJson, WordsOfReasonsAreReadBack) {
  for (const ReportReason reason :
       {ReportReason::kPrivacy, ReportReason::kCopyright, ReportReason::kOffensive,
        ReportReason::kWrong, ReportReason::kOther})
    EXPECT_EQ(*ParseReportReason(ReportReasonWord(reason)), reason);
  EXPECT_EQ(ParseReportReason("x").status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
