// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the body of a request ends, as its headers say.

#include <kj/compat/http.h>

#include <optional>

#include "cli/service/http_message.h"

namespace veduta {

// The answer to a request whose headers say its length in more than one way, or as others may read
// in another way: a proxy could take the end of such a body for a request of somebody else (RFC
// 9112, sections 6.1 and 6.3). The connection must be closed after it. What kj refuses by itself,
// as several encodings, does not come so far.
std::optional<HttpAnswer> RefuseLength(const kj::HttpHeaders& headers);

// Whether the body comes in chunks. No further request of the connection is to be taken then:
// chunks may be written so that others see another end of them.
bool ComesInChunks(const kj::HttpHeaders& headers);

}  // namespace veduta
