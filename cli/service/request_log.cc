// SPDX-License-Identifier: Apache-2.0
#include "cli/service/request_log.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <random>
#include <variant>

#include "cli/service/city_routes.h"
#include "cli/service/openapi.h"

namespace veduta {
namespace {

constexpr size_t kIdBytesMax = 64;

bool IsWellFormed(const std::string& id) {
  return !id.empty() && id.size() <= kIdBytesMax && std::ranges::all_of(id, [](unsigned char c) {
    return std::isalnum(c) || c == '.' || c == '_' || c == '-';
  });
}

Json TextOrNull(const std::string& text) {
  return text.empty() ? Json() : Json(text);
}

}  // namespace

std::string RequestId(const std::string& of_client) {
  if (IsWellFormed(of_client)) return of_client;
  thread_local std::mt19937_64 random(std::random_device{}());
  char id[17];
  std::snprintf(id, sizeof(id), "%016lx", random());
  return id;
}

std::string RouteOf(const HttpRequest& request) {
  const auto found = FindRoute(request);
  const auto* const match = std::get_if<RouteMatch>(&found);
  return match == nullptr ? "" : PathTemplate(*match->route);
}

Json ToJson(const RequestEntry& entry) {
  return {{"request", entry.id},
          {"door", entry.door},
          {"method", entry.method},
          {"route", TextOrNull(entry.route)},
          {"status", entry.status},
          {"bytes", entry.bytes},
          {"ms", entry.ms},
          {"who", TextOrNull(entry.who)},
          {"upload", entry.upload == 0 ? Json() : Json(entry.upload)}};
}

}  // namespace veduta
