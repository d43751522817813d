// SPDX-License-Identifier: Apache-2.0
#include "cli/service/page_answer.h"

#include <algorithm>

#include "cli/page/page_files.h"

namespace veduta {

HttpAnswer AnswerWithPage(Engine* /*engine*/, const HttpRequest& request, const PathArguments&) {
  const std::string name = request.path.empty() ? "index.html" : request.path.front();
  const auto files = PageFiles();
  const auto file = std::ranges::find(files, name, &PageFile::name);
  VEDUTA_CHECK(file != files.end(), "the page has no file " + name);
  HttpAnswer answer{200, std::string(file->content_type), "", {}};
  answer.headers = {{"ETag", std::string(file->etag)},
                    {"Content-Security-Policy",
                     "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' "
                     "blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
                     "frame-ancestors 'none'"},
                    {"Referrer-Policy", "no-referrer"}};
  if (request.if_none_match == file->etag) {
    answer.code = 304;
  } else {
    answer.body = file->bytes;
  }
  return answer;
}

}  // namespace veduta
