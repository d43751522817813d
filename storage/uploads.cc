// SPDX-License-Identifier: Apache-2.0
#include "storage/uploads.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "storage/records/contribution_record.h"
#include "storage/records/upload_record.h"

namespace veduta {

namespace {

// Enters the photo in its contribution, once; one whose contribution is gone is a part of none.
Status EnterContribution(const DatabaseFiles& files, UploadRecord* upload, WriteBuffer* batch) {
  if (upload->contribution == 0) return Status::Ok();
  const ValueReader reader(files, nullptr);
  ContributionRecord contribution;
  contribution.number = upload->contribution;
  const std::string key = ContributionKey(contribution.number);
  const auto decode = [&](std::string_view value) { return Decode(value, &contribution); };
  VEDUTA_ASSIGN_OR_RETURN(const bool is_there, reader.Read(Family::kContributions, key, decode));
  if (!is_there) {
    upload->contribution = 0;
    return Status::Ok();
  }
  ContributedPhoto photo;
  photo.contribution = contribution.number;
  photo.upload = upload->number;
  photo.name = upload->name;
  const std::string photo_key = ContributedPhotoKey(photo.contribution, photo.upload);
  VEDUTA_ASSIGN_OR_RETURN(const bool was_entered, reader.Has(Family::kContributions, photo_key));
  if (was_entered) return Status::Ok();
  ++contribution.photo_count;
  batch->Put(Family::kContributions, key, Encode(contribution));
  batch->Put(Family::kContributions, photo_key, Encode(photo));
  return Status::Ok();
}

}  // namespace

Status PutUpload(DatabaseFiles& files, UploadRecord* upload, std::span<const uint8_t> bytes,
                 WriteBuffer* batch) {
  uint64_t last = 0;  // 0 where none ever came
  const auto decode = [&](std::string_view value) { return DecodeLastUpload(value, &last); };
  VEDUTA_RETURN_IF_ERROR(
      ValueReader(files, nullptr).Read(Family::kUploads, LastUploadKey(), decode).status());
  if (upload->number == 0) upload->number = last + 1;
  VEDUTA_RETURN_IF_ERROR(EnterContribution(files, upload, batch));
  batch->Put(Family::kUploads, UploadKey(upload->number), Encode(*upload));
  batch->Put(Family::kUploads, UploadBytesKey(upload->number),
             std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  batch->Put(Family::kUploads, LastUploadKey(),
             std::string_view(EncodeLastUpload(std::max(last, upload->number))));
  return Status::Ok();
}

Result<uint64_t> AddUpload(DatabaseFiles& files, UploadRecord upload,
                           std::span<const uint8_t> bytes, bool sync) {
  WriteBuffer batch(files);
  VEDUTA_RETURN_IF_ERROR(PutUpload(files, &upload, bytes, &batch));
  VEDUTA_RETURN_IF_ERROR(batch.Write(sync, "take a photo into the line"));
  return upload.number;
}

Status NameUploadCamera(DatabaseFiles& files, uint64_t number, const std::string& camera,
                        bool sync) {
  UploadRecord upload;
  const auto decode = [&](std::string_view value) { return Decode(value, number, &upload); };
  VEDUTA_ASSIGN_OR_RETURN(
      const bool is_there,
      ValueReader(files, nullptr).Read(Family::kUploads, UploadKey(number), decode));
  if (!is_there) return Status::NotFound("no photo waits as upload " + std::to_string(number));
  upload.camera = camera;
  WriteBuffer batch(files);
  batch.Put(Family::kUploads, UploadKey(number), Encode(upload));
  return batch.Write(sync, "name the camera of a photo that waits");
}

Status DeleteUpload(DatabaseFiles& files, uint64_t number, const ContributedPhoto* fate) {
  WriteBuffer batch(files);
  batch.Delete(Family::kUploads, UploadKey(number));
  batch.Delete(Family::kUploads, UploadBytesKey(number));
  if (fate != nullptr) {
    const std::string key = ContributedPhotoKey(fate->contribution, fate->upload);
    // Its contribution may be gone by now.
    VEDUTA_ASSIGN_OR_RETURN(const bool is_there,
                            ValueReader(files, nullptr).Has(Family::kContributions, key));
    if (is_there) batch.Put(Family::kContributions, key, Encode(*fate));
  }
  return batch.Write(/*sync=*/false, "take a photo out of the line");
}

Result<std::vector<UploadRecord>> ListUploads(const ValueReader& reader) {
  std::vector<UploadRecord> all;
  VEDUTA_RETURN_IF_ERROR(reader.Scan(Family::kUploads, UploadPrefix(), "",
                                     [&](std::string_view key, std::string_view value, bool*) {
                                       UploadEntry entry{};
                                       uint64_t number = 0;
                                       VEDUTA_RETURN_IF_ERROR(ParseUploadKey(key, &entry, &number));
                                       return Decode(value, number, &all.emplace_back());
                                     }));
  return all;
}

}  // namespace veduta
