// SPDX-License-Identifier: Apache-2.0
#include "cli/service/byte_range.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <string_view>

namespace veduta {
namespace {

constexpr std::string_view kUnit = "bytes=";
constexpr uint64_t kEnd = std::numeric_limits<uint64_t>::max();

std::optional<uint64_t> NumberOf(std::string_view text) {
  uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (text.empty() || end != text.data() + text.size()) return std::nullopt;
  // More bytes than can be counted are all that there are.
  if (error == std::errc::result_out_of_range) return kEnd;
  return error == std::errc() ? std::optional(number) : std::nullopt;
}

// First byte and the one after the last, of `size`; the first is not within where there are none.
struct Bytes {
  uint64_t first, end;
};

std::optional<Bytes> BytesOf(std::string_view range, uint64_t size) {
  if (!range.starts_with(kUnit)) return std::nullopt;
  range.remove_prefix(kUnit.size());
  const size_t dash = range.find('-');
  if (dash == range.npos) return std::nullopt;
  const std::string_view from = range.substr(0, dash), to = range.substr(dash + 1);
  if (from.empty()) {  // so many at the end
    const auto count = NumberOf(to);
    if (!count) return std::nullopt;
    return Bytes{*count == 0 ? size : size - std::min(*count, size), size};
  }
  const auto first = NumberOf(from);
  const auto last = to.empty() ? std::optional(kEnd) : NumberOf(to);
  if (!first || !last || *first > *last) return std::nullopt;
  return Bytes{*first, *last < size ? *last + 1 : size};
}

}  // namespace

void CutToRange(const std::string& range, const std::string& if_range, HttpAnswer* answer) {
  if (answer->code != 200 || answer->content_type.ends_with("json")) return;
  answer->headers.emplace_back("Accept-Ranges", "bytes");
  const uint64_t size = answer->body.size();
  const auto bytes = BytesOf(range, size);
  if (!bytes) return;
  const bool is_same =
      if_range.empty() || (!if_range.starts_with("W/") && if_range == HeaderOf(*answer, "ETag"));
  if (!is_same) return;
  const std::string of_size = "/" + std::to_string(size);
  if (bytes->first >= size) {
    *answer = Problem(416, "there are " + std::to_string(size) + " bytes: ask for some of them");
    answer->headers.emplace_back("Content-Range", "bytes *" + of_size);
    return;
  }
  answer->code = 206;
  answer->headers.emplace_back("Content-Range", "bytes " + std::to_string(bytes->first) + "-" +
                                                    std::to_string(bytes->end - 1) + of_size);
  answer->body = answer->body.substr(bytes->first, bytes->end - bytes->first);
}

}  // namespace veduta
