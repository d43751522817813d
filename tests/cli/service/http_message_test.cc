// SPDX-License-Identifier: Apache-2.0
// Goal: answers and problems carry what RFC 9457 and docs/serving.md say of them.
// Method: each made once and compared with the text that is expected.
#include "cli/service/http_message.h"

#include <gtest/gtest.h>

#include <set>

namespace veduta {
namespace {

HttpRequest WithBody(const std::string& type, std::vector<uint8_t> body) {
  HttpRequest request;
  request.content_type = type;
  request.body = std::move(body);
  return request;
}

TEST(HttpMessage, AProblemSaysWhatIsWrong) {
  const HttpAnswer answer = Problem(404, "there is no \"x\"");
  EXPECT_EQ(answer.code, 404u);
  EXPECT_EQ(answer.content_type, "application/problem+json");
  EXPECT_EQ(answer.body,
            "{\"title\":\"Not Found\",\"status\":404,\"detail\":\"there is no \\\"x\\\"\"}\n");
  EXPECT_EQ(Problem(409, "known", {{"id", 3}}).body,
            "{\"title\":\"Conflict\",\"status\":409,\"detail\":\"known\",\"photo\":{\"id\":3}}\n");
}

TEST(HttpMessage, EveryFailureHasItsCode) {
  EXPECT_EQ(ProblemOf(Status::InvalidArgument("x")).code, 400u);
  EXPECT_EQ(ProblemOf(Status::NotFound("x")).code, 404u);
  EXPECT_EQ(ProblemOf(Status::AlreadyExists("x")).code, 409u);
  EXPECT_EQ(ProblemOf(Status::Corruption("x")).code, 500u);
  EXPECT_EQ(ProblemOf(Status::IoError("x")).code, 500u);
  for (const Status& passes : {Status::Busy("x"), Status::Cancelled("x"), Status::NoMemory("x")}) {
    const HttpAnswer answer = ProblemOf(passes);
    EXPECT_EQ(answer.code, 503u);
    ASSERT_EQ(answer.headers.size(), 1u);
    EXPECT_EQ(answer.headers[0].first, "Retry-After");
  }
}

TEST(HttpMessage, CodesHaveTheirPhrases) {
  std::set<std::string> phrases;
  for (const uint32_t code :
       {200, 201, 304, 400, 403, 404, 405, 408, 409, 413, 415, 422, 429, 500, 503})
    EXPECT_TRUE(phrases.insert(HttpPhrase(code)).second);
  EXPECT_FALSE(phrases.contains("Unknown"));
  EXPECT_STREQ(HttpPhrase(999), "Unknown");
}

TEST(HttpMessage, ABodyIsAPhotoByItsType) {
  for (const char* type : {"image/jpeg", "image/heic", "application/octet-stream"})
    EXPECT_FALSE(RefuseBody(WithBody(type, {1})));
  for (const char* type : {"", "text/plain", "multipart/form-data", "imagejpeg"})
    EXPECT_EQ(RefuseBody(WithBody(type, {1}))->code, 415u);
  EXPECT_EQ(RefuseBody(WithBody("image/jpeg", {}))->code, 400u);
}

TEST(HttpMessage, AParameterThatIsNotGivenIsTheOtherValue) {
  HttpRequest request;
  request.query = {{"name", "a.jpg"}, {"empty", ""}};
  EXPECT_EQ(Parameter(request, "name", "b"), "a.jpg");
  EXPECT_EQ(Parameter(request, "empty", "b"), "");
  EXPECT_EQ(Parameter(request, "none", "b"), "b");
}

TEST(HttpMessage, ATokenComesAfterItsScheme) {
  EXPECT_EQ(BearerOf("Bearer veduta-1-x"), "veduta-1-x");
  EXPECT_EQ(BearerOf("bearer veduta-1-x"), "veduta-1-x");
  for (const char* header : {"", "Bearer", "Bearer ", "Basic YTpi", "veduta-1-x", "Bearerveduta-1"})
    EXPECT_EQ(BearerOf(header), "") << header;
}

}  // namespace
}  // namespace veduta
