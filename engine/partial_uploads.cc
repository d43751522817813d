// SPDX-License-Identifier: Apache-2.0
// The members of Engine and of Questions about photos that arrive in parts.
#include <sodium.h>

#include <ctime>
#include <utility>

#include "engine/engine.h"
#include "engine/parts.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

std::string HexOf(const PartialUploadId& id) {
  char text[2 * sizeof(PartialUploadId) + 1];
  sodium_bin2hex(text, sizeof(text), id.data(), id.size());
  return text;
}

// Nothing where the text is no id.
std::optional<PartialUploadId> IdOf(const std::string& hex) {
  PartialUploadId id{};
  size_t bytes = 0;
  if (hex.size() != 2 * id.size() ||
      sodium_hex2bin(id.data(), id.size(), hex.data(), hex.size(), nullptr, &bytes, nullptr) != 0 ||
      bytes != id.size())
    return std::nullopt;
  return id;
}

PartialUploadAnswer ToAnswer(const PartialUploadRecord& partial) {
  return {HexOf(partial.id),      partial.name,           partial.contributor,
          partial.camera,         partial.contribution,   partial.token,
          partial.length_bytes,   partial.received_bytes, partial.begun_unix_s,
          partial.touched_unix_s, partial.upload};
}

Result<PartialUploadRecord> Find(const Snapshot& snapshot, const std::string& hex) {
  if (const std::optional<PartialUploadId> id = IdOf(hex)) {
    VEDUTA_ASSIGN_OR_RETURN(std::optional<PartialUploadRecord> found,
                            snapshot.contributing().FindPartialUpload(*id));
    if (found) return *std::move(found);
  }
  return Status::NotFound(
      "no upload of this address is on its way: it has ended, was given up, or "
      "came no further for too long");
}

bool IsOfSame(const PartialUploadRecord& partial, const PartialUploadRequest& request) {
  if (request.token != 0) return partial.token == request.token;
  return partial.token == 0 && partial.contributor == request.contributor;
}

// kBusy where there is no room for one more of this length.
Status CheckRoom(const Snapshot& snapshot, const PartialUploadRequest& request,
                 const PartialUploadLimits& limits) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PartialUploadRecord> all,
                          snapshot.contributing().ListPartialUploads());
  uint64_t count = 0, bytes = request.length_bytes, count_each = 0, bytes_each = bytes;
  for (const PartialUploadRecord& partial : all) {
    ++count;
    bytes += partial.length_bytes;
    if (!IsOfSame(partial, request)) continue;
    ++count_each;
    bytes_each += partial.length_bytes;
  }
  if (count_each >= limits.count_each_max || bytes_each > limits.bytes_each_max)
    return Status::Busy("you have " + std::to_string(count_each) +
                        " uploads on their way, and may not have more: finish some, or give "
                        "them up");
  if (count >= limits.count_max || bytes > limits.bytes_max)
    return Status::Busy(std::to_string(count) +
                        " uploads are on their way, and no more may be: come again later");
  return Status::Ok();
}

}  // namespace

Status PartialUploadLimits::Check() const {
  return OptionBounds()
      .Between("count_max", count_max, 1, 1'000'000)
      .AtLeast("bytes_max", static_cast<double>(bytes_max), 1)
      .AtLeast("count_each_max", count_each_max, 1)
      .AtLeast("bytes_each_max", static_cast<double>(bytes_each_max), 1)
      .status();
}

Result<PartialUploadAnswer> Questions::PartialUpload(const std::string& id) const {
  VEDUTA_ASSIGN_OR_RETURN(const PartialUploadRecord partial, Find(*view_->snapshot, id));
  return ToAnswer(partial);
}

Result<PartialUploadAnswer> Engine::BeginUpload(const PartialUploadRequest& request,
                                                const PartialUploadLimits& limits) {
  EngineParts& parts = *parts_;
  const uint64_t size_bytes_max = parts.tuning.prepare.limits.size_bytes_max;
  if (request.length_bytes == 0 || request.length_bytes > size_bytes_max)
    return Status::InvalidArgument("a photo has 1 to " + std::to_string(size_bytes_max) +
                                   " bytes, and this one is to have " +
                                   std::to_string(request.length_bytes));
  VEDUTA_RETURN_IF_ERROR(parts.FindNamed(request.camera).status());
  VEDUTA_RETURN_IF_ERROR(parts.CheckContribution(request.contribution, request.contributor));
  PartialUploadRecord partial;
  if (sodium_init() < 0)
    return Status::IoError("libsodium cannot start: there are no random numbers");
  randombytes_buf(partial.id.data(), partial.id.size());
  partial.name = request.name;
  partial.contributor = request.contributor;
  partial.camera = request.camera;
  partial.contribution = request.contribution;
  partial.token = request.token;
  partial.length_bytes = request.length_bytes;
  partial.begun_unix_s = partial.touched_unix_s = std::time(nullptr);
  const std::lock_guard lock(parts.lining_mutex);
  VEDUTA_RETURN_IF_ERROR(CheckRoom(*parts.database->GetSnapshot(), request, limits));
  VEDUTA_RETURN_IF_ERROR(parts.database->PutPartialUpload(partial));
  return ToAnswer(partial);
}

Result<PartialUploadAnswer> Engine::ContinueUpload(const std::string& id, uint64_t offset,
                                                   std::span<const uint8_t> bytes,
                                                   AnswerCallback answered) {
  EngineParts& parts = *parts_;
  const std::lock_guard lock(parts.lining_mutex);
  const std::shared_ptr<const Snapshot> snapshot = parts.database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(PartialUploadRecord partial, Find(*snapshot, id));
  if (offset != partial.received_bytes)
    return Status::AlreadyExists("the bytes from " + std::to_string(partial.received_bytes) +
                                 " on come next, and these begin at " + std::to_string(offset));
  if (bytes.size() > partial.length_bytes - offset)
    return Status::InvalidArgument("there are more bytes than the " +
                                   std::to_string(partial.length_bytes) + " that were announced");
  if (bytes.empty()) return ToAnswer(partial);
  partial.touched_unix_s = std::time(nullptr);
  if (offset + bytes.size() < partial.length_bytes) {
    VEDUTA_RETURN_IF_ERROR(parts.database->AppendToPartialUpload(bytes, &partial));
    return ToAnswer(partial);
  }
  VEDUTA_ASSIGN_OR_RETURN(std::vector<uint8_t> photo, snapshot->contributing().GetPieces(partial));
  photo.insert(photo.end(), bytes.begin(), bytes.end());
  UploadRecord upload;
  upload.name = partial.name;
  upload.contributor = partial.contributor;
  upload.camera = partial.camera;
  upload.contribution = partial.contribution;
  upload.photo = HashContent(photo);
  upload.size_bytes = photo.size();
  upload.time_unix_s = partial.touched_unix_s;
  VEDUTA_RETURN_IF_ERROR(parts.database->FinishPartialUpload(photo, &upload, &partial));
  PartialUploadAnswer answer = ToAnswer(partial);
  answer.is_in_line = parts.LineStored(upload, std::move(answered)).ok();
  return answer;
}

Status Engine::AbandonUpload(const std::string& id) {
  const std::lock_guard lock(parts_->lining_mutex);
  VEDUTA_ASSIGN_OR_RETURN(const PartialUploadRecord partial,
                          Find(*parts_->database->GetSnapshot(), id));
  return parts_->database->DeletePartialUpload(partial);
}

Result<size_t> Engine::AbandonUploadsBefore(int64_t time_unix_s) {
  return parts_->DeletePartialUploads(
      [&](const PartialUploadRecord& partial) { return partial.touched_unix_s < time_unix_s; });
}

Result<size_t> EngineParts::DeletePartialUploads(
    const std::function<bool(const PartialUploadRecord&)>& is_wanted) {
  const std::lock_guard lock(lining_mutex);
  const std::shared_ptr<const Snapshot> snapshot = database->GetSnapshot();
  size_t count = 0;
  for (const bool have_arrived : {false, true}) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PartialUploadRecord> all,
                            snapshot->contributing().ListPartialUploads(have_arrived));
    for (const PartialUploadRecord& partial : all) {
      if (!is_wanted(partial)) continue;
      VEDUTA_RETURN_IF_ERROR(database->DeletePartialUpload(partial));
      if (!have_arrived) ++count;
    }
  }
  return count;
}

}  // namespace veduta
