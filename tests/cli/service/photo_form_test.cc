// SPDX-License-Identifier: Apache-2.0
// Goal: a form is one request for each of its photos, by the same sender, and its fields count as
//   parameters.
// Method: forms as browsers send them; names that lead out of a folder; the answers put together.
#include "cli/service/photo_form.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

std::string Part(const std::string& parameters, const std::string& bytes) {
  return "--b\r\nContent-Disposition: form-data; " + parameters + "\r\n\r\n" + bytes + "\r\n";
}

HttpRequest Form(const std::string& parts) {
  HttpRequest request;
  request.method = "POST";
  request.path = {"v1", "photos"};
  request.content_type = "multipart/form-data";
  request.headers["Content-Type"] = "multipart/form-data; boundary=b";
  request.who = "anna";
  request.token_number = 3;
  request.may_name_others = false;
  const std::string body = parts + "--b--\r\n";
  request.body.assign(body.begin(), body.end());
  return request;
}

std::string Text(const std::vector<uint8_t>& bytes) {
  return {bytes.begin(), bytes.end()};
}

TEST(PhotoForm, EachPhotoIsARequest) {
  HttpRequest request =
      Form(Part("name=camera", "c") + Part("name=contributor", "") +
           Part("name=p; filename=1.jpg", "one") + Part("name=p; filename=\"d/2.jpg\"", "two") +
           Part("name=q; filename=\"\"", ""));
  const auto photos = ReadPhotoForm(&request);
  ASSERT_OK(photos);
  ASSERT_EQ(photos->size(), 2u);
  EXPECT_EQ(request.query, (std::map<std::string, std::string>{{"camera", "c"}}));
  const HttpRequest first = RequestOf(photos->front(), request);
  EXPECT_EQ(Text(first.body), "one");
  EXPECT_EQ(first.query.at("name"), "1.jpg");
  EXPECT_EQ(first.query.at("camera"), "c");
  EXPECT_EQ(first.who, "anna");
  EXPECT_EQ(first.token_number, 3u);
  EXPECT_FALSE(first.may_name_others);
  EXPECT_FALSE(RefuseBody(first));
  const HttpRequest last = RequestOf(photos->back(), std::move(request));
  EXPECT_EQ(Text(last.body), "two");
  EXPECT_EQ(last.query.at("name"), "d/2.jpg");
}

TEST(PhotoForm, OneMayBeNamed) {
  HttpRequest request =
      Form(Part("name=name", "mine.jpg") + Part("name=p; filename=\"../1.jpg\"", "one"));
  const auto photos = ReadPhotoForm(&request);
  ASSERT_OK(photos);
  EXPECT_EQ(photos->front().name, "mine.jpg");
}

TEST(PhotoForm, WrongOnesAreRefused) {
  const std::string photo = Part("name=p; filename=1.jpg", "one");
  const std::pair<std::string, const char*> kWrong[] = {
      {Part("name=camera", "c"), "no photo"},
      {Part("name=p; filename=\"\"", ""), "no photo"},
      {photo + Part("name=licence", "x"), "licence"},
      {photo + Part("name=camera", "c") + Part("name=camera", "d"), "twice"},
      {photo + Part("name=camera", std::string(2000, 'c')), "too long"},
      {photo + Part("name=camera", "a\nb"), "control"},
      {photo + photo + Part("name=name", "a.jpg"), "2 photos"},
      {Part("name=p; filename=\"../1.jpg\"", "one"), "leads out"},
      {Part("name=p; filename=\"/etc/passwd\"", "one"), "leads out"},
      {Part("name=p; filename=\"a//b.jpg\"", "one"), "leads out"},
      {Part("name=p; filename=\"\xff.jpg\"", "one"), "UTF-8"},
      {Part("name=p; filename=\"\"", "one"), "leads out"}};
  for (const auto& [parts, word] : kWrong) {
    HttpRequest request = Form(parts);
    const auto photos = ReadPhotoForm(&request);
    EXPECT_EQ(photos.status().code(), StatusCode::kInvalidArgument) << word;
    EXPECT_NE(photos.status().message().find(word), std::string::npos) << photos.status().message();
  }
}

TEST(PhotoForm, TheAnswerTellsOfEach) {
  HttpAnswer taken = JsonAnswer(202, {{"upload", 7}});
  HttpAnswer answer = AnswerToForm({{"a.jpg", Problem(429, "full")}, {"b.jpg", taken}});
  EXPECT_EQ(answer.code, 202u);
  EXPECT_EQ(Json::parse(answer.body),
            Json::parse(R"({"photos":[{"image":"a.jpg","status":429,"upload":null,)"
                        R"("detail":"full"},)"
                        R"({"image":"b.jpg","status":202,"upload":7,"detail":null}]})"));
  HttpAnswer full = Problem(429, "full");
  full.headers.emplace_back("Retry-After", "9");
  answer = AnswerToForm({{"a.jpg", full}, {"b.jpg", full}});
  EXPECT_EQ(answer.code, 429u);
  EXPECT_EQ(HeaderOf(answer, "Retry-After"), "9");
  EXPECT_EQ(Json::parse(answer.body)["photos"].size(), 2u);
}

}  // namespace
}  // namespace veduta
