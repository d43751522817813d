// SPDX-License-Identifier: Apache-2.0
// ParseForm: forms in which photos are sent. The input is the header with the content type, a line
// feed, and the body.
#include "cli/service/multipart_form.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  const std::string head = "multipart/form-data; boundary=";
  return {head +
              "b\n--b\r\nContent-Disposition: form-data; name=\"camera\"\r\n\r\nc\r\n--b\r\n"
              "Content-Disposition: form-data; name=\"photo\"; filename=\"a \\\"1\\\".jpg\"\r\n"
              "Content-Type: image/jpeg\r\n\r\n\xff\xd8--b\r\n-\r\n--b--\r\n",
          head +
              "\"a b\"\n--a b\r\ncontent-disposition:form-data;name=x;filename=\r\n"
              "Content-Transfer-Encoding: binary\r\n\r\n\r\n--a b--",
          head + "b\n--b--"};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using veduta::fuzz::Expect;
  const std::string_view text = veduta::fuzz::Text(data, size);
  const size_t line = text.find('\n');
  if (line == text.npos) return 0;
  const std::string_view body = text.substr(line + 1);
  const auto parts =
      veduta::ParseForm({data + line + 1, body.size()}, std::string(text.substr(0, line)));
  if (!parts.ok()) return 0;
  Expect(parts->size() <= veduta::kFormPartsMax, "a form has no more parts than it may");
  size_t end = 0;
  for (const veduta::FormPart& part : *parts) {
    Expect(part.begin > end && part.begin <= part.end && part.end < body.size(),
           "parts lie one after the other in the body");
    Expect(body.substr(part.end).starts_with("\r\n--"), "a part ends at a boundary");
    end = part.end;
  }
  return 0;
}
