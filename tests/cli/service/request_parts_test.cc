// SPDX-License-Identifier: Apache-2.0
// Goal: numbers and texts in requests are taken whole or refused, by a word that names them.
// Method: values at the borders, of other types, with something before or behind them.
#include "cli/service/request_parts.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(RequestParts, NumbersOfTheQuery) {
  HttpRequest request;
  request.query["from"] = "7";
  EXPECT_EQ(*NumberParameter(request, "from", 1, 1, 9), 7u);
  EXPECT_EQ(*NumberParameter(request, "count", 3, 1, 9), 3u);
  EXPECT_FALSE(NumberParameter(request, "from", 1, 1, 6).ok());
}

TEST(RequestParts, TextsOfObjects) {
  const Json object = Json::parse(R"({"a": "x", "b": 7, "contribution": 9})");
  EXPECT_EQ(*TextMember(object, "a"), "x");
  EXPECT_FALSE(TextMember(object, "b").ok());
  EXPECT_FALSE(TextMember(object, "c").ok());
  EXPECT_EQ(*OptionalText(object, "c"), "");
  EXPECT_FALSE(OptionalText(object, "b").ok());
  EXPECT_EQ(*OptionalNumber(object, "contribution", 9), 9u);
  EXPECT_EQ(*OptionalNumber(Json::object(), "contribution", 9), 0u);
  EXPECT_FALSE(OptionalNumber(object, "contribution", 8).ok());
  for (const Json& wrong : {Json("9"), Json(-1), Json(0), Json(1.5), Json(uint64_t{1} << 32)})
    EXPECT_FALSE(OptionalNumber({{"contribution", wrong}}, "contribution", 9).ok()) << wrong;
}

HttpRequest WithBody(const std::string& body) {
  HttpRequest request;
  request.body.assign(body.begin(), body.end());
  return request;
}

TEST(RequestParts, BodiesAreObjectsOfSomeBytesAndSomeDepth) {
  EXPECT_EQ((*JsonObjectOf(WithBody(R"({"a": [1, {"b": 2}]})")))["a"][1]["b"], 2);
  for (const char* wrong : {"", "7", "[]", "{", R"({"a": })", "{} {}"})
    EXPECT_EQ(JsonObjectOf(WithBody(wrong)).status().code(), StatusCode::kInvalidArgument) << wrong;
  const HttpRequest large = WithBody("{" + std::string(98, ' ') + "}");
  EXPECT_OK(JsonObjectOf(large, 100));
  EXPECT_FALSE(RefuseLargeJson(large, 100));
  EXPECT_EQ(JsonObjectOf(large, 99).status().code(), StatusCode::kInvalidArgument);
  ASSERT_TRUE(RefuseLargeJson(large, 99));
  EXPECT_EQ(RefuseLargeJson(large, 99)->code, 413u);
  const auto nested = [](size_t depth) {
    return WithBody(R"({"a": )" + std::string(depth - 1, '[') + std::string(depth - 1, ']') + "}");
  };
  EXPECT_OK(JsonObjectOf(nested(16)));
  for (const size_t depth : {17u, 1'000u, 100'000u}) {
    const Status deep = JsonObjectOf(nested(depth)).status();
    EXPECT_EQ(deep.code(), StatusCode::kInvalidArgument);
    EXPECT_NE(deep.message().find("in each other"), std::string::npos) << deep.message();
  }
  EXPECT_FALSE(JsonObjectOf(WithBody(R"({"a": )" + std::string(1'000, '['))).ok());
}

TEST(RequestParts, MembersThatNobodyReadsAreRefused) {
  EXPECT_OK(RefuseOthers(Json::object(), {}));
  EXPECT_OK(RefuseOthers({{"a", 1}}, {"a", "b"}));
  const Status refused = RefuseOthers({{"a", 1}, {"c", 1}}, {"a", "b"});
  EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(refused.message().find("'c'"), std::string::npos);
}

TEST(RequestParts, WhoAsks) {
  HttpRequest request;
  EXPECT_EQ(*ActorOf({{"actor", "anna"}}, request), "anna");
  EXPECT_FALSE(ActorOf(Json::object(), request).ok());
  request.who = "kai";
  EXPECT_EQ(*ActorOf({{"actor", "anna"}}, request), "kai") << "whose token it is";
}

}  // namespace
}  // namespace veduta
