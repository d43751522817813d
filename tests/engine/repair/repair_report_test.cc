// SPDX-License-Identifier: Apache-2.0
// Goal: the report names every damage, every photo, and where the damaged database is.
// Method: an answer with everything in it.
#include "engine/repair/repair_report.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(RepairReport, NamesEverything) {
  RepairAnswer answer;
  answer.findings = {{"the state cannot be read", "it is derived"}};
  answer.lost = {"lost.jpg"};
  answer.retried = {"retried.jpg"};
  answer.written_out = {"out.jpg"};
  answer.kept_path = "db.damaged-1";
  answer.photos_path = "db.damaged-1.photos";
  const std::string text = RepairReport("db", answer);
  for (const char* wanted :
       {"the state cannot be read; it is derived", "  lost.jpg\n", "  retried.jpg\n", "  out.jpg\n",
        "db.damaged-1 until", "db.damaged-1.photos"})
    EXPECT_NE(text.find(wanted), std::string::npos) << wanted << "\n" << text;
  EXPECT_EQ(text.find("anew"), std::string::npos);
  answer.is_rebuilt = true;
  EXPECT_NE(RepairReport("db", answer).find("anew"), std::string::npos);
}

}  // namespace
}  // namespace veduta
