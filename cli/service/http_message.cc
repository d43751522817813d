// SPDX-License-Identifier: Apache-2.0
#include "cli/service/http_message.h"

#include <cctype>
#include <string_view>

namespace veduta {
namespace {

// When to try again after a failure that is not the request's, in seconds. Chosen by hand.
constexpr const char* kRetryAfterS = "5";

uint32_t CodeOf(StatusCode code) {
  switch (code) {
    case StatusCode::kOk:
      return 200;
    case StatusCode::kInvalidArgument:
      return 400;
    case StatusCode::kNotFound:
      return 404;
    case StatusCode::kAlreadyExists:
      return 409;
    case StatusCode::kBusy:
    case StatusCode::kCancelled:
    case StatusCode::kNoMemory:
      return 503;
    case StatusCode::kCorruption:
    case StatusCode::kIoError:
      return 500;
  }
  return 500;
}

}  // namespace

std::span<const char* const> HeadersOfRoutes() {
  static constexpr const char* kNames[] = {
      "Tus-Resumable",   "Upload-Length",       "Upload-Offset", "Upload-Metadata",
      "Upload-Checksum", "Upload-Defer-Length", "Upload-Concat", "Host",
      "Content-Type",    "X-Forwarded-Proto",   "Range",         "If-Range",
      "Accept"};
  return kNames;
}

const char* HttpPhrase(uint32_t code) {
  static const std::map<uint32_t, const char*> kPhrases = {
      {200, "OK"},
      {201, "Created"},
      {202, "Accepted"},
      {204, "No Content"},
      {206, "Partial Content"},
      {304, "Not Modified"},
      {400, "Bad Request"},
      {401, "Unauthorized"},
      {403, "Forbidden"},
      {404, "Not Found"},
      {405, "Method Not Allowed"},
      {408, "Request Timeout"},
      {409, "Conflict"},
      {410, "Gone"},
      {412, "Precondition Failed"},
      {413, "Content Too Large"},
      {415, "Unsupported Media Type"},
      {416, "Range Not Satisfiable"},
      {422, "Unprocessable Content"},
      {429, "Too Many Requests"},
      {460, "Checksum Mismatch"},
      {500, "Internal Server Error"},
      {501, "Not Implemented"},
      {503, "Service Unavailable"},
  };
  const auto found = kPhrases.find(code);
  return found == kPhrases.end() ? "Unknown" : found->second;
}

HttpAnswer JsonAnswer(uint32_t code, const Json& value) {
  HttpAnswer answer;
  answer.code = code;
  answer.body = JsonLine(value) + "\n";
  return answer;
}

HttpAnswer Problem(uint32_t code, const std::string& detail, const Json& photo) {
  Json json = {{"title", HttpPhrase(code)}, {"status", code}, {"detail", detail}};
  if (!photo.is_null()) json["photo"] = photo;
  HttpAnswer answer = JsonAnswer(code, json);
  answer.content_type = "application/problem+json";
  return answer;
}

HttpAnswer ProblemOf(const Status& status) {
  HttpAnswer answer = Problem(CodeOf(status.code()), status.message());
  if (status.code() == StatusCode::kCorruption) {
    Json json = Json::parse(answer.body);
    json["damaged"] = true;
    answer.body = JsonLine(json) + "\n";
  }
  if (answer.code == 503) answer.headers.emplace_back("Retry-After", kRetryAfterS);
  answer.is_of_disk = status.code() == StatusCode::kIoError;
  return answer;
}

HttpAnswer ComeAgain(uint32_t code, const std::string& detail, uint32_t seconds) {
  HttpAnswer answer = Problem(code, detail);
  answer.headers.emplace_back("Retry-After", std::to_string(seconds));
  return answer;
}

std::string MediaType(std::string header) {
  header.resize(std::min(header.size(), header.find(';')));
  while (!header.empty() && header.back() == ' ') header.pop_back();
  for (char& c : header) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return header;
}

std::string HeaderOf(const HttpAnswer& answer, const std::string& name) {
  for (const auto& [header, value] : answer.headers) {
    if (header == name) return value;
  }
  return "";
}

std::string HeaderOf(const HttpRequest& request, const std::string& name) {
  const auto found = request.headers.find(name);
  return found == request.headers.end() ? "" : found->second;
}

std::string BearerOf(const std::string& header) {
  static constexpr std::string_view kScheme = "bearer ";
  if (header.size() <= kScheme.size()) return "";
  for (size_t i = 0; i < kScheme.size(); ++i) {
    if (std::tolower(static_cast<unsigned char>(header[i])) != kScheme[i]) return "";
  }
  return header.substr(kScheme.size());
}

std::string Parameter(const HttpRequest& request, const std::string& name,
                      const std::string& otherwise) {
  const auto found = request.query.find(name);
  return found == request.query.end() ? otherwise : found->second;
}

std::optional<HttpAnswer> RefuseBody(const HttpRequest& request) {
  const std::string& type = request.content_type;
  if (!type.starts_with("image/") && type != "application/octet-stream") {
    return Problem(415, "the content type is '" + type +
                            "': send the bytes of the photo as they are, as image/jpeg or another "
                            "image type");
  }
  // The owner's `veduta add` is told what becomes of an empty file, as without a daemon.
  if (request.body.empty() && !request.is_of_owner)
    return Problem(400, "there is no photo: the body is empty");
  return std::nullopt;
}

}  // namespace veduta
