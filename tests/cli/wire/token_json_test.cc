// SPDX-License-Identifier: Apache-2.0
// Goal: tokens have the keys that docs/json.md lists, in one order, with null for what never was.
// Method: answers of the door with known values, as text.
#include "cli/wire/token_json.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(TokenJson, HasEveryKey) {
  EXPECT_EQ(JsonLine(ToJson(TokenAnswer{3, "anna", Role::kCurator, 5, 0, 0, {}})),
            R"({"number":3,"name":"anna","role":"curator","created":5,"expires":null,)"
            R"("revoked":null,"photos_per_day":null,"bytes_per_day":null,)"
            R"("requests_per_second":null,"link":false,"contribution":null,)"
            R"("reconstruction":null})");
  EXPECT_EQ(
      JsonLine(ToJson(TokenAnswer{3, "anna", Role::kViewer, 5, 6, 7, {8, 9, 10}, true, 0, 12})),
      R"({"number":3,"name":"anna","role":"viewer","created":5,"expires":6,"revoked":7,)"
      R"("photos_per_day":8,"bytes_per_day":9,"requests_per_second":10,"link":true,)"
      R"("contribution":null,"reconstruction":12})");
  EXPECT_EQ(JsonLine(ToJson(NewToken{3, "veduta-3-x"})), R"({"number":3,"token":"veduta-3-x"})");
  EXPECT_EQ(JsonLine(LinkJson(NewToken{3, "veduta-3-x"})),
            R"({"number":3,"path":"/#link=veduta-3-x"})");
}

}  // namespace
}  // namespace veduta
