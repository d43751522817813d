// SPDX-License-Identifier: Apache-2.0
#pragma once
// The headers of requests that are read and that kj does not know by itself.

#include <kj/compat/http.h>

#include <string>
#include <utility>
#include <vector>

#include "cli/service/http_message.h"

namespace veduta {

struct KnownHeaders {
  explicit KnownHeaders(kj::HttpHeaderTable::Builder* builder)
      : origin(builder->add("Origin")),
        none_match(builder->add("If-None-Match")),
        prefer(builder->add("Prefer")),
        last_event(builder->add("Last-Event-ID")),
        fetch_site(builder->add("Sec-Fetch-Site")),
        authorization(builder->add("Authorization")),
        method_override(builder->add("X-HTTP-Method-Override")),
        request_id(builder->add("X-Request-Id")),
        forwarded_for(builder->add("X-Forwarded-For")) {
    for (const char* const name : HeadersOfRoutes())
      of_routes.emplace_back(name, builder->add(name));
  }
  const kj::HttpHeaderId origin, none_match, prefer, last_event, fetch_site, authorization,
      method_override, request_id, forwarded_for;
  std::vector<std::pair<const char*, kj::HttpHeaderId>> of_routes;
};

}  // namespace veduta
