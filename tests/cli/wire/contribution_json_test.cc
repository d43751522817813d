// SPDX-License-Identifier: Apache-2.0
// Goal: contributions and uploads in parts have the keys that docs/serving.md lists, in one order.
// Method: answers of the door with known values, as text.
#include "cli/wire/contribution_json.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(ContributionJson, HasEveryKey) {
  EXPECT_EQ(JsonLine(ToJson(ContributionAnswer{3, "anna", "a walk", "CC0", 5, 0, 7})),
            R"({"contribution":3,"contributor":"anna","comment":"a walk","licence":"CC0",)"
            R"("opened":5,"closed":null,"photos":7,"hidden":false})");
  const ContributionSums sums{1, 2, 3, 4, 5, 6, 7, 8, {{Reason::kNoTexture, 9}}};
  EXPECT_EQ(JsonLine(ToJson(sums)),
            R"({"arriving":1,"waiting":2,"placed":3,"postponed":4,"refused":5,"duplicates":6,)"
            R"("failed":7,"removed":8,"reasons":[{"reason":")" +
                ReasonSentence(Reason::kNoTexture, "") + R"(","photos":9}]})");
  EXPECT_EQ(
      JsonLine(ToJson(ContributedPhotoAnswer{4, "1.jpg", "placed", ImageId(2), Reason::kNone})),
      R"({"upload":4,"image":"1.jpg","state":"placed","id":2,"reason":null})");
  PartialUploadAnswer partial;
  partial.id = "a secret of sorts, which the address has";
  partial.name = "1.jpg";
  partial.contributor = "anna";
  partial.length_bytes = 9;
  partial.received_bytes = 4;
  partial.begun_unix_s = 5;
  EXPECT_EQ(JsonLine(ToJson(partial)),
            R"({"image":"1.jpg","contributor":"anna","camera":"","contribution":null,)"
            R"("length":9,"offset":4,"time":5,"upload":null})");
}

}  // namespace
}  // namespace veduta
