// SPDX-License-Identifier: Apache-2.0
#include "cli/service/tus_uploads.h"

#include <algorithm>
#include <ctime>
#include <utility>

#include "cli/service/path_numbers.h"
#include "cli/service/photo_name.h"
#include "cli/service/tus_message.h"
#include "cli/wire/contribution_json.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// When to come again where too much is on its way, in seconds. Chosen by hand.
constexpr const char* kRetryAfterS = "60";

HttpAnswer NoSuch(uint32_t code) {
  return Problem(code, code == 410 ? "the upload came no further for too long, and was given up: "
                                     "begin anew"
                                   : "no upload of this address is on its way: begin anew");
}

HttpAnswer NoContent() {
  HttpAnswer answer;
  answer.code = 204;
  answer.content_type.clear();
  return answer;
}

// As CheckPhotoName, with what to do where there is none.
Status CheckFileName(const std::string& name) {
  if (name.empty())
    return Status::InvalidArgument(
        "the photo has no name: send 'filename' in Upload-Metadata, in Base64");
  return CheckPhotoName(name);
}

bool IsPhotoType(const std::string& type) {
  return type.empty() || type.starts_with("image/") || type == "application/octet-stream";
}

}  // namespace

Status TusOptions::Check() const {
  return OptionBounds()
      .Part("limits", limits.Check())
      .Between("length_bytes_max", static_cast<double>(length_bytes_max), 1, 0x1p40)
      .Between("keep_s", keep_s, 1, 31'536'000)
      .status();
}

HttpAnswer TusUploads::Answer(Engine* engine, const HttpRequest& request) {
  if (request.method == "OPTIONS") return Options();
  // A browser that looks at an upload says nothing of the protocol.
  const std::string version = HeaderOf(request, "Tus-Resumable");
  if (version != kTusVersion && !(version.empty() && request.method == "GET")) {
    HttpAnswer other =
        Problem(412, "the version of the tus protocol is " + std::string(kTusVersion) +
                         ": name it in the header Tus-Resumable");
    other.headers.emplace_back("Tus-Version", kTusVersion);
    return other;
  }
  if (request.method == "POST") return Begin(engine, request);
  if (request.method == "PATCH") return Continue(engine, request);
  if (request.method == "DELETE") return GiveUp(engine, request);
  HttpAnswer refusal;
  const Result<PartialUploadAnswer> upload = Find(*engine, request, &refusal);
  if (!upload.ok()) return refusal;
  HttpAnswer answer = JsonAnswer(200, ToJson(*upload));
  AddHeaders(*upload, &answer);
  answer.headers.emplace_back("Upload-Length", std::to_string(upload->length_bytes));
  return answer;
}

HttpAnswer TusUploads::Options() const {
  HttpAnswer answer = NoContent();
  answer.headers = {{"Tus-Version", kTusVersion},
                    {"Tus-Extension", kTusExtensions},
                    {"Tus-Max-Size", std::to_string(options_.length_bytes_max)},
                    {"Tus-Checksum-Algorithm", kTusChecksums}};
  return answer;
}

Result<PartialUploadRequest> TusUploads::RequestOf(const Engine& engine,
                                                   const HttpRequest& request) const {
  PartialUploadRequest wanted;
  if (request.headers.contains("Upload-Defer-Length") || request.headers.contains("Upload-Concat"))
    return Status::InvalidArgument(
        "a photo is announced with its length (Upload-Length), and "
        "arrives in one upload");
  VEDUTA_ASSIGN_OR_RETURN(
      wanted.length_bytes,
      WholeNumber("the header Upload-Length", HeaderOf(request, "Upload-Length"), 1, UINT64_MAX));
  VEDUTA_ASSIGN_OR_RETURN(auto metadata, ParseTusMetadata(HeaderOf(request, "Upload-Metadata")));
  wanted.name = metadata["filename"].empty() ? metadata["name"] : metadata["filename"];
  VEDUTA_RETURN_IF_ERROR(CheckFileName(wanted.name));
  wanted.camera = metadata["camera"];
  VEDUTA_RETURN_IF_ERROR(CheckName("the name of a camera", wanted.camera));
  wanted.token = request.token_number;
  std::string sender = request.who.empty() ? "anonymous" : request.who;
  if (const std::string& number = metadata["contribution"]; !number.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(wanted.contribution, ContributionNumber(number));
    VEDUTA_ASSIGN_OR_RETURN(const ContributionAnswer contribution,
                            engine.Ask().Contribution(wanted.contribution));
    if (request.may_name_others) sender = contribution.contributor;
  }
  wanted.contributor = metadata["contributor"].empty() ? sender : metadata["contributor"];
  VEDUTA_RETURN_IF_ERROR(CheckName("the name of a contributor", wanted.contributor));
  return wanted;
}

HttpAnswer TusUploads::Begin(Engine* engine, const HttpRequest& request) {
  if (!request.body.empty() && request.content_type != kTusContentType)
    return Problem(415, "the content type is '" + request.content_type +
                            "': the first part of a photo is sent as " + kTusContentType);
  const Result<PartialUploadRequest> wanted = RequestOf(*engine, request);
  if (!wanted.ok()) return ProblemOf(wanted.status());
  auto metadata = ParseTusMetadata(HeaderOf(request, "Upload-Metadata"));
  const std::string type =
      (*metadata)["filetype"].empty() ? (*metadata)["type"] : (*metadata)["filetype"];
  if (!IsPhotoType(type))
    return Problem(415, "the file is said to be '" + type.substr(0, 100) + "', which is no photo");
  if (!request.may_name_others && wanted->contributor != request.who)
    return Problem(403, "photos are sent under the token's name, " + request.who +
                            ": leave 'contributor' out");
  if (wanted->length_bytes > options_.length_bytes_max)
    return Problem(413, "the photo is larger than " + std::to_string(options_.length_bytes_max) +
                            " bytes, the most that is taken");
  if (request.body.size() > wanted->length_bytes)
    return Problem(413, "there are more bytes than Upload-Length says");
  if (auto full = intake_.RefuseFull(wanted->contributor, wanted->length_bytes))
    return *std::move(full);
  if (auto refusal = quotas_.TakePhoto(request, wanted->length_bytes)) return *std::move(refusal);
  Result<PartialUploadAnswer> upload = engine->BeginUpload(*wanted, options_.limits);
  if (!upload.ok()) quotas_.GivePhoto(request, wanted->length_bytes);
  if (upload.status().code() == StatusCode::kBusy) {
    HttpAnswer full = Problem(429, upload.status().message());
    full.headers.emplace_back("Retry-After", kRetryAfterS);
    return full;
  }
  if (!upload.ok()) return NotStored(upload.status());
  HttpAnswer answer = JsonAnswer(201, ToJson(*upload));
  if (!request.body.empty()) {
    Result<bool> is_right = true;
    if (request.headers.contains("Upload-Checksum"))
      is_right = HasTusChecksum(HeaderOf(request, "Upload-Checksum"), request.body);
    // The upload is there even where its first part cannot be taken: the client goes on from 0.
    if (is_right.ok() && *is_right) {
      const auto after = intake_.Continue(engine, upload->id, 0, request.body);
      if (after.ok()) {
        upload = after;
      } else if (write_failed_) {
        write_failed_(after.status());
      }
    }
    answer = JsonAnswer(201, ToJson(*upload));
  }
  answer.headers.emplace_back("Location", "/v1/tus/" + upload->id);
  AddHeaders(*upload, &answer);
  return answer;
}

HttpAnswer TusUploads::Continue(Engine* engine, const HttpRequest& request) {
  if (request.content_type != kTusContentType)
    return Problem(415, "the content type is '" + request.content_type +
                            "': a part of a photo is sent as " + kTusContentType);
  const auto offset =
      WholeNumber("the header Upload-Offset", HeaderOf(request, "Upload-Offset"), 0, UINT64_MAX);
  if (!offset.ok()) return ProblemOf(offset.status());
  HttpAnswer refusal;
  const Result<PartialUploadAnswer> upload = Find(*engine, request, &refusal);
  if (!upload.ok()) return refusal;
  if (*offset == upload->received_bytes && request.body.size() > upload->length_bytes - *offset)
    return Problem(413, "there are more bytes than the " + std::to_string(upload->length_bytes) +
                            " that Upload-Length has announced");
  if (request.headers.contains("Upload-Checksum")) {
    const auto is_right = HasTusChecksum(HeaderOf(request, "Upload-Checksum"), request.body);
    if (!is_right.ok()) return ProblemOf(is_right.status());
    if (!*is_right)
      return Problem(460,
                     "the bytes have not the sum that Upload-Checksum says: nothing of them "
                     "is stored, send them again");
  }
  const std::shared_lock lock(giving_up_mutex_);
  const auto after = intake_.Continue(engine, upload->id, *offset, request.body);
  if (!after.ok()) return NotStored(after.status());
  HttpAnswer answer = NoContent();
  AddHeaders(*after, &answer);
  return answer;
}

HttpAnswer TusUploads::GiveUp(Engine* engine, const HttpRequest& request) {
  const std::unique_lock lock(giving_up_mutex_);
  HttpAnswer refusal;
  const Result<PartialUploadAnswer> upload = Find(*engine, request, &refusal);
  if (!upload.ok()) return refusal;
  const Status abandoned = engine->AbandonUpload(upload->id);
  if (!abandoned.ok()) return NotStored(abandoned);
  // A photo that is in line was sent; and the owner has no quota to give it back to.
  if (upload->upload == 0 && upload->token == request.token_number)
    quotas_.GivePhoto(request, upload->length_bytes,
                      static_cast<double>(std::time(nullptr) - upload->begun_unix_s));
  return NoContent();
}

HttpAnswer TusUploads::NotStored(const Status& status) const {
  if (write_failed_) write_failed_(status);
  // Nothing is stored of what the disk refuses, and another time it may take it.
  if (status.code() != StatusCode::kIoError) return ProblemOf(status);
  return ProblemOf(
      Status::Busy("this cannot be stored now, send it again later: " + status.message()));
}

Result<PartialUploadAnswer> TusUploads::Find(const Engine& engine, const HttpRequest& request,
                                             HttpAnswer* refusal) const {
  Result<PartialUploadAnswer> upload = engine.Ask().PartialUpload(request.path.back());
  if (!upload.ok()) {
    *refusal =
        upload.status().code() == StatusCode::kNotFound ? NoSuch(404) : ProblemOf(upload.status());
    return upload;
  }
  const bool is_theirs = request.is_of_owner || upload->token == request.token_number;
  const bool is_gone = upload->touched_unix_s + options_.keep_s <= std::time(nullptr);
  if (is_theirs && !is_gone) return upload;
  *refusal = NoSuch(is_theirs ? 410 : 404);
  return Status::NotFound("no such upload");
}

void TusUploads::AddHeaders(const PartialUploadAnswer& upload, HttpAnswer* answer) const {
  answer->headers.emplace_back("Upload-Offset", std::to_string(upload.received_bytes));
  answer->headers.emplace_back("Upload-Expires", HttpDate(upload.touched_unix_s + options_.keep_s));
  answer->headers.emplace_back("Cache-Control", "no-store");
}

Status TusUploads::Expire(Engine* engine) const {
  return engine->AbandonUploadsBefore(std::time(nullptr) - options_.keep_s).status();
}

}  // namespace veduta
