// SPDX-License-Identifier: Apache-2.0
#include "cli/service/photo_form.h"

#include <algorithm>
#include <string_view>

#include "cli/service/multipart_form.h"
#include "cli/service/photo_name.h"

namespace veduta {
namespace {

constexpr size_t kFieldBytesMax = 1024;  // chosen by hand: the longest is a name
constexpr std::string_view kFields[] = {"name", "camera", "contributor", "contribution"};

Status TakeField(const FormPart& part, HttpRequest* request) {
  const std::string what = "the field '" + part.name.substr(0, 100) + "' of the form";
  if (std::ranges::find(kFields, part.name) == std::end(kFields))
    return Status::InvalidArgument(what +
                                   " is none: name, camera, contributor and contribution are, "
                                   "and a photo is sent with a file name");
  if (part.end - part.begin > kFieldBytesMax) return Status::InvalidArgument(what + " is too long");
  const std::string value(request->body.begin() + static_cast<ptrdiff_t>(part.begin),
                          request->body.begin() + static_cast<ptrdiff_t>(part.end));
  if (value.empty()) return Status::Ok();
  VEDUTA_RETURN_IF_ERROR(CheckName(what, value));
  if (!request->query.emplace(part.name, value).second)
    return Status::InvalidArgument(what + " is given twice");
  return Status::Ok();
}

}  // namespace

Result<std::vector<FormPhoto>> ReadPhotoForm(HttpRequest* request) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<FormPart> parts,
                          ParseForm(request->body, HeaderOf(*request, "Content-Type")));
  std::vector<FormPhoto> photos;
  for (const FormPart& part : parts) {
    if (!part.is_file) {
      VEDUTA_RETURN_IF_ERROR(TakeField(part, request));
    } else if (!part.file_name.empty() || part.end > part.begin) {
      photos.push_back({part.file_name, part.begin, part.end});
    }
  }
  if (photos.empty())
    return Status::InvalidArgument(
        "there is no photo in the form: send a file, as curl -F "
        "'photo=@IMG_1234.jpg' does");
  const std::string name = Parameter(*request, "name");
  if (!name.empty() && photos.size() > 1)
    return Status::InvalidArgument("a name is given for " + std::to_string(photos.size()) +
                                   " photos: send them by their own");
  if (!name.empty()) photos.front().name = name;
  for (const FormPhoto& photo : photos) VEDUTA_RETURN_IF_ERROR(CheckPhotoName(photo.name));
  return photos;
}

HttpRequest RequestOf(const FormPhoto& photo, const HttpRequest& request) {
  HttpRequest one;
  one.method = request.method;
  one.path = request.path;
  one.query = request.query;
  one.query["name"] = photo.name;
  one.content_type = "application/octet-stream";
  one.prefers_async = request.prefers_async;
  one.who = request.who;
  one.token_number = request.token_number;
  one.quota = request.quota;
  one.may_name_others = request.may_name_others;
  one.sight = request.sight;
  one.body.assign(request.body.begin() + static_cast<ptrdiff_t>(photo.begin),
                  request.body.begin() + static_cast<ptrdiff_t>(photo.end));
  return one;
}

HttpRequest RequestOf(const FormPhoto& photo, HttpRequest&& request) {
  std::vector<uint8_t> body = std::move(request.body);
  request.body.clear();
  HttpRequest one = RequestOf({photo.name, 0, 0}, request);
  body.resize(photo.end);
  body.erase(body.begin(), body.begin() + static_cast<ptrdiff_t>(photo.begin));
  one.body = std::move(body);
  one.body_share = std::move(request.body_share);
  return one;
}

HttpAnswer AnswerToForm(const std::vector<std::pair<std::string, HttpAnswer>>& answers) {
  Json photos = Json::array();
  bool is_any_taken = false;
  for (const auto& [name, answer] : answers) {
    Json told = Json::parse(answer.body, nullptr, /*allow_exceptions=*/false);
    if (!told.is_object()) told = Json::object();
    is_any_taken |= answer.code < 400;
    photos.push_back({{"image", name},
                      {"status", answer.code},
                      {"upload", told.value("upload", Json())},
                      {"detail", told.value("detail", Json())}});
  }
  if (is_any_taken) return JsonAnswer(202, {{"photos", std::move(photos)}});
  HttpAnswer refused = answers.front().second;
  if (answers.size() > 1) {
    Json json = Json::parse(refused.body, nullptr, /*allow_exceptions=*/false);
    json["photos"] = std::move(photos);
    refused.body = JsonLine(json) + "\n";
  }
  return refused;
}

}  // namespace veduta
