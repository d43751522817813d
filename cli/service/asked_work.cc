// SPDX-License-Identifier: Apache-2.0
#include "cli/service/asked_work.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "cli/service/remote_address.h"

namespace veduta {
namespace {

// Parts of the paths of routes that compute.
constexpr std::array<std::string_view, 6> kLongWork = {"localize",  "candidates", "uncertainty",
                                                       "thumbnail", "surface",    "points"};

// Parts of the paths of routes that write with the engine's turn, where they are no questions.
// Photos, whole and in parts, are put on the disk without it.
constexpr std::array<std::string_view, 9> kChanges = {"allowed",   "cameras", "contributions",
                                                      "forbidden", "hidden",  "links",
                                                      "reports",   "shown",   "tokens"};

bool IsIn(const auto& words, const std::string& word) {
  return std::ranges::count(words, word) > 0;
}

}  // namespace

WorkKind WorkKindOf(const CityRoute& route) {
  const std::vector<std::string>& path = route.path;
  const std::string_view method = route.method;
  if (path.size() < 2) return WorkKind::kShort;
  const bool is_removal = (method == "POST" && path[1] == "removals") ||
                          (method == "DELETE" && path[1] == "contributions");
  if (is_removal) return WorkKind::kRemoval;
  const bool is_georeference = method == "POST" && path[1] == "georeference";
  if (route.is_for_owner_alone || is_georeference) return WorkKind::kCommand;
  const bool is_report = path.back() == "report";
  if (method != "GET" && (is_report || IsIn(kChanges, path[1]))) return WorkKind::kChange;
  const bool is_long =
      std::ranges::any_of(path, [](const std::string& part) { return IsIn(kLongWork, part); });
  return is_long ? WorkKind::kLong : WorkKind::kShort;
}

std::string AskerOf(const HttpRequest& request) {
  if (request.is_of_owner) return "owner";
  // By the number and not by the text: one token has one turn, however it is spelled.
  if (request.token_number != 0) return "token " + std::to_string(request.token_number);
  return SenderOf(request.address);
}

std::string HolderOf(const HttpRequest& request) {
  if (request.is_of_owner) return "";
  return request.token_number != 0 ? AskerOf(request) : CountedSender(request.address, {});
}

}  // namespace veduta
