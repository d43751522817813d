// SPDX-License-Identifier: Apache-2.0
#include "cli/service/multipart_form.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <string_view>

namespace veduta {
namespace {

constexpr size_t kBoundaryMax = 70;  // RFC 2046, section 5.1.1
constexpr std::string_view kBoundarySigns = "'()+_,-./:=? ";
constexpr std::string_view kLineEnd = "\r\n";

Status Wrong(const std::string& what) {
  return Status::InvalidArgument("the form cannot be read: " + what);
}

std::string Lower(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

void SkipSpaces(std::string_view* text) {
  while (!text->empty() && (text->front() == ' ' || text->front() == '\t')) text->remove_prefix(1);
}

// A quoted text, in which only a quote and a backslash are escaped, or one up to ";" or a space.
std::optional<std::string> TakeValue(std::string_view* text) {
  std::string value;
  if (!text->starts_with('"')) {
    const size_t end = std::min(text->find_first_of("; \t"), text->size());
    value = text->substr(0, end);
    text->remove_prefix(end);
    return value.empty() ? std::nullopt : std::optional(value);
  }
  text->remove_prefix(1);
  while (!text->empty()) {
    char c = text->front();
    text->remove_prefix(1);
    if (c == '"') return value;
    const bool is_escape =
        c == '\\' && !text->empty() && (text->front() == '"' || text->front() == '\\');
    if (is_escape) {
      c = text->front();
      text->remove_prefix(1);
    }
    value += c;
  }
  return std::nullopt;  // it does not end
}

// What stands before the first ";" of a header's value, in lower case, and its parameters.
struct HeaderValue {
  std::string value;
  std::map<std::string, std::string> parameters;
};

std::optional<HeaderValue> ParseHeaderValue(std::string_view text) {
  const size_t first = std::min(text.find(';'), text.size());
  std::string_view value = text.substr(0, first);
  while (!value.empty() && value.back() == ' ') value.remove_suffix(1);
  HeaderValue parsed{Lower(value), {}};
  text.remove_prefix(first);
  while (!text.empty()) {
    text.remove_prefix(1);  // ";"
    SkipSpaces(&text);
    if (text.empty()) break;
    const size_t equals = text.find('=');
    if (equals == text.npos) return std::nullopt;
    const std::string name = Lower(text.substr(0, equals));
    text.remove_prefix(equals + 1);
    const auto one = TakeValue(&text);
    if (!one || !parsed.parameters.emplace(name, *one).second) return std::nullopt;
    SkipSpaces(&text);
    if (!text.empty() && text.front() != ';') return std::nullopt;
  }
  return parsed;
}

bool IsBoundaryLetter(unsigned char c) {
  return c < 0x80 &&
         (std::isalnum(c) != 0 || kBoundarySigns.find(static_cast<char>(c)) != kBoundarySigns.npos);
}

Result<std::string> BoundaryOf(const std::string& content_type) {
  const auto header = ParseHeaderValue(content_type);
  if (!header || !header->parameters.contains("boundary"))
    return Wrong("its content type names no boundary");
  const std::string& boundary = header->parameters.at("boundary");
  const bool is_right = !boundary.empty() && boundary.size() <= kBoundaryMax &&
                        boundary.back() != ' ' && std::ranges::all_of(boundary, IsBoundaryLetter);
  if (!is_right) return Wrong("its boundary is not one of RFC 2046");
  return boundary;
}

// By names in lower case.
Result<std::map<std::string, std::string>> LinesOf(std::string_view head) {
  std::map<std::string, std::string> lines;
  while (!head.empty()) {
    const size_t end = std::min(head.find(kLineEnd), head.size());
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(std::min(end + kLineEnd.size(), head.size()));
    const size_t colon = line.find(':');
    const bool is_plain = std::ranges::none_of(
        line, [](unsigned char c) { return (c < 0x20 && c != '\t') || c == 0x7f; });
    const bool is_name =
        colon != line.npos && colon > 0 && std::ranges::none_of(line.substr(0, colon), [](char c) {
          return c == ' ' || c == '\t' || c == '"';
        });
    if (!is_plain || !is_name) return Wrong("a part has a header that is none");
    std::string_view value = line.substr(colon + 1);
    SkipSpaces(&value);
    if (lines.size() >= kFormHeadLinesMax) return Wrong("a part has too many headers");
    if (!lines.emplace(Lower(line.substr(0, colon)), value).second)
      return Wrong("a part has a header twice");
  }
  return lines;
}

Result<FormPart> PartOf(std::string_view head) {
  VEDUTA_ASSIGN_OR_RETURN(auto lines, LinesOf(head));
  const auto disposition = ParseHeaderValue(lines["content-disposition"]);
  if (!disposition || disposition->value != "form-data" ||
      !disposition->parameters.contains("name"))
    return Wrong("a part has no header 'Content-Disposition: form-data' with a name");
  if (Lower(lines["content-type"]).starts_with("multipart/"))
    return Wrong("a part is a form itself: send each photo as a part of its own");
  const std::string coding = Lower(lines["content-transfer-encoding"]);
  if (!coding.empty() && coding != "binary" && coding != "8bit" && coding != "7bit")
    return Wrong("a part is encoded: send the bytes as they are");
  FormPart part;
  part.name = disposition->parameters.at("name");
  const auto file = disposition->parameters.find("filename");
  part.is_file = file != disposition->parameters.end();
  if (part.is_file) part.file_name = file->second;
  return part;
}

}  // namespace

Result<std::vector<FormPart>> ParseForm(std::span<const uint8_t> body,
                                        const std::string& content_type) {
  VEDUTA_ASSIGN_OR_RETURN(const std::string boundary, BoundaryOf(content_type));
  const std::string_view text(reinterpret_cast<const char*>(body.data()), body.size());
  const std::string delimiter = "\r\n--" + boundary;
  if (!text.starts_with(std::string_view(delimiter).substr(kLineEnd.size())))
    return Wrong("it does not begin with its boundary");
  std::vector<FormPart> parts;
  size_t at = delimiter.size() - kLineEnd.size();
  for (;;) {
    const std::string_view rest = text.substr(at);
    if (rest == "--" || rest == "--\r\n") return parts;
    if (!rest.starts_with(kLineEnd)) return Wrong("something follows on its boundary");
    if (parts.size() >= kFormPartsMax)
      return Wrong("it has more than " + std::to_string(kFormPartsMax) + " parts");
    at += kLineEnd.size();
    const std::string_view head_and_more = text.substr(at, kFormHeadBytesMax);
    const size_t head_size = head_and_more.find("\r\n\r\n");
    if (head_size == head_and_more.npos)
      return Wrong("the headers of a part do not end, or have more than " +
                   std::to_string(kFormHeadBytesMax) + " bytes");
    VEDUTA_ASSIGN_OR_RETURN(FormPart part, PartOf(head_and_more.substr(0, head_size)));
    part.begin = at + head_size + 2 * kLineEnd.size();
    part.end = text.find(delimiter, part.begin);
    if (part.end == text.npos) return Wrong("it ends within a part");
    at = part.end + delimiter.size();
    parts.push_back(std::move(part));
  }
}

}  // namespace veduta
