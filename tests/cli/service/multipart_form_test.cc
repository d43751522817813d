// SPDX-License-Identifier: Apache-2.0
// Goal: forms of browsers and of curl are read to the byte, and nothing that is not as RFC 7578 has
//   it.
// Method: forms as these send them; each rule broken on its own; every prefix of a form.
#include "cli/service/multipart_form.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

constexpr const char* kType = "multipart/form-data; boundary=X-1";

Result<std::vector<FormPart>> Parse(const std::string& body, const std::string& type = kType) {
  return ParseForm({reinterpret_cast<const uint8_t*>(body.data()), body.size()}, type);
}

std::string Part(const std::string& head, const std::string& bytes) {
  return "--X-1\r\n" + head + "\r\n\r\n" + bytes + "\r\n";
}

std::string File(const std::string& name, const std::string& bytes) {
  return Part("Content-Disposition: form-data; name=\"photo\"; filename=\"" + name +
                  "\"\r\nContent-Type: image/jpeg",
              bytes);
}

const std::string kEnd = "--X-1--\r\n";

TEST(MultipartForm, FieldsAndFiles) {
  const std::string bytes("a\r\n--X\r\n\0--X-\r\n\xff", 16);
  const std::string body = Part("Content-Disposition: form-data; name=\"camera\"", "c") +
                           File("1 \\\"one\\\".jpg", bytes) + File("", "") + kEnd;
  const auto parts = Parse(body);
  ASSERT_OK(parts);
  ASSERT_EQ(parts->size(), 3u);
  const auto text = [&](const FormPart& part) {
    return body.substr(part.begin, part.end - part.begin);
  };
  EXPECT_EQ((*parts)[0].name, "camera");
  EXPECT_FALSE((*parts)[0].is_file);
  EXPECT_EQ(text((*parts)[0]), "c");
  EXPECT_EQ((*parts)[1].name, "photo");
  EXPECT_TRUE((*parts)[1].is_file);
  EXPECT_EQ((*parts)[1].file_name, "1 \"one\".jpg");
  EXPECT_EQ(text((*parts)[1]), bytes);
  EXPECT_TRUE((*parts)[2].is_file);
  EXPECT_EQ((*parts)[2].begin, (*parts)[2].end);
}

TEST(MultipartForm, BoundariesAndHeadersInOtherWriting) {
  EXPECT_OK(Parse("--a b\r\ncontent-disposition:form-data;NAME=x;filename=y\r\n\r\n\r\n--a b--",
                  "Multipart/Form-Data; charset=utf-8; boundary=\"a b\""));
  EXPECT_OK(Parse("--X-1--"));
}

TEST(MultipartForm, EveryRuleIsKept) {
  const auto refused = [](const std::string& body, const std::string& word,
                          const std::string& type = kType) {
    const auto parts = Parse(body, type);
    EXPECT_EQ(parts.status().code(), StatusCode::kInvalidArgument) << body.substr(0, 200);
    EXPECT_NE(parts.status().message().find(word), std::string::npos) << parts.status().message();
  };
  const std::string good = File("a.jpg", "x");
  for (const char* type :
       {"multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=\"",
        "multipart/form-data; boundary=\"a\r\nb\"", "multipart/form-data; boundary=a; boundary=b",
        "multipart/form-data; boundary=\"a \""})
    refused(good + kEnd, "boundary", type);
  refused(good + kEnd, "boundary", "multipart/form-data; boundary=" + std::string(71, 'a'));
  refused("", "begin");
  refused("hello\r\n" + good + kEnd, "begin");
  refused(good, "within a part");
  refused(good + "--X-1--more", "something follows");
  refused("--X-1x" + good + kEnd, "something follows");
  refused("--X-1\r\nContent-Disposition: form-data; name=\"a\"\r\n\r\nnever ends", "within a part");
  refused("--X-1\r\nX: " + std::string(5000, 'x'), "do not end");
  refused(Part("X: y", "x") + kEnd, "Content-Disposition");
  refused(Part("Content-Disposition: attachment; name=\"a\"", "x") + kEnd, "Content-Disposition");
  refused(Part("Content-Disposition: form-data", "x") + kEnd, "Content-Disposition");
  refused(Part("Content-Disposition: form-data; name=\"a", "x") + kEnd, "Content-Disposition");
  refused(Part("Content-Disposition: form-data; name=\"a\"; name=\"b\"", "x") + kEnd,
          "Content-Disposition");
  const std::string named = "Content-Disposition: form-data; name=\"a\"";
  refused(Part(named + "\r\n" + named, "x") + kEnd, "twice");
  refused(Part(named + "\r\n folded: x", "x") + kEnd, "header that is none");
  refused(Part(named + "\r\nno colon", "x") + kEnd, "header that is none");
  refused(Part(named + std::string("\r\nX: \0", 6), "x") + kEnd, "header that is none");
  refused(Part(named + "\r\nContent-Type: multipart/mixed; boundary=y", "x") + kEnd, "form itself");
  refused(Part(named + "\r\nContent-Transfer-Encoding: base64", "x") + kEnd, "encoded");
  std::string many_lines = named, many_parts;
  for (int i = 0; i < 20; ++i) many_lines += "\r\nX" + std::to_string(i) + ": y";
  refused(Part(many_lines, "x") + kEnd, "too many headers");
  for (int i = 0; i < 129; ++i) many_parts += Part(named, "x");
  refused(many_parts + kEnd, "more than 128 parts");
}

TEST(MultipartForm, NoPrefixIsAForm) {
  const std::string body = File("a.jpg", "bytes") + File("b.jpg", "more") + kEnd;
  for (size_t size = 0; size + 2 < body.size(); ++size)
    EXPECT_FALSE(Parse(body.substr(0, size)).ok()) << size;
}

}  // namespace
}  // namespace veduta
