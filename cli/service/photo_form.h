// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that come as a form (multipart_form.h).

#include <string>
#include <utility>
#include <vector>

#include "cli/service/http_message.h"

namespace veduta {

struct FormPhoto {
  std::string name;
  size_t begin = 0, end = 0;  // its bytes within the body of the request
};

// The photos of the form in the request's body, one at least, in their order; its fields become
// parameters of the request's query. Choosers of files that were left empty are passed over.
// kInvalidArgument.
Result<std::vector<FormPhoto>> ReadPhotoForm(HttpRequest* request);

// A request that sends this one alone, by the same sender; it copies the photo's bytes.
HttpRequest RequestOf(const FormPhoto& photo, const HttpRequest& request);
// The same, by the bytes that are there. It leaves the request without a body.
HttpRequest RequestOf(const FormPhoto& photo, HttpRequest&& request);

// The answer to a form of several photos, by the answers to each: 202 where one is taken, and the
// code of the first one where none is.
HttpAnswer AnswerToForm(const std::vector<std::pair<std::string, HttpAnswer>>& answers);

}  // namespace veduta
