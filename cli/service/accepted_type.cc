// SPDX-License-Identifier: Apache-2.0
#include "cli/service/accepted_type.h"

#include <algorithm>
#include <charconv>

namespace veduta {
namespace {

constexpr std::string_view kBlank = " \t";

// The text up to `end`, without blanks around it, in lower case; it and the end are taken off.
std::string Take(std::string_view* rest, char end) {
  const size_t length = std::min(rest->find(end), rest->size());
  std::string_view part = rest->substr(0, length);
  rest->remove_prefix(std::min(length + 1, rest->size()));
  part.remove_prefix(std::min(part.find_first_not_of(kBlank), part.size()));
  part = part.substr(0, part.find_last_not_of(kBlank) + 1);
  std::string text(part);
  std::ranges::transform(text, text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c + ('a' - 'A')) : c;
  });
  return text;
}

// 3 for the type itself, 2 for all of its kind, 1 for all, 0 for others.
int FitOf(const std::string& range, std::string_view type) {
  if (range == type) return 3;
  if (range == "*/*") return 1;
  const bool is_kind = range.size() > 2 && range.ends_with("/*");
  return is_kind && type.starts_with(std::string_view(range).substr(0, range.size() - 1)) ? 2 : 0;
}

}  // namespace

double QualityOf(std::string_view accept, std::string_view type) {
  if (accept.find_first_not_of(kBlank) == accept.npos) return 1;
  int best_fit = 0;
  double quality = 0;
  while (!accept.empty()) {
    const size_t length = std::min(accept.find(','), accept.size());
    std::string_view one = accept.substr(0, length);
    accept.remove_prefix(std::min(length + 1, accept.size()));
    int fit = FitOf(Take(&one, ';'), type);
    double q = 1;
    while (!one.empty()) {
      const std::string parameter = Take(&one, ';');
      if (parameter.starts_with("version=") && parameter != "version=1.0" &&
          parameter != "version=\"1.0\"")
        fit = 0;
      if (!parameter.starts_with("q=")) continue;
      const auto [end, error] =
          std::from_chars(parameter.data() + 2, parameter.data() + parameter.size(), q);
      if (error != std::errc() || end != parameter.data() + parameter.size() || !(q >= 0 && q <= 1))
        fit = 0;
    }
    if (fit > best_fit) quality = q;
    best_fit = std::max(best_fit, fit);
  }
  return quality;
}

bool PrefersGeoPose(std::string_view accept) {
  return QualityOf(accept, kGeoPoseType) > QualityOf(accept, "application/json");
}

}  // namespace veduta
