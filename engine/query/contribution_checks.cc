// SPDX-License-Identifier: Apache-2.0
// Contributions: each has a number that was given, its photos are counted, and those that are to
// wait for their turn do.
#include <cstring>
#include <map>

#include "engine/query/checked_city.h"
#include "engine/query/stored_records.h"
#include "storage/records/contribution_record.h"
#include "storage/records/partial_upload_record.h"
#include "storage/records/record_parts.h"

namespace veduta {
namespace {

struct StoredContributions {
  std::map<uint32_t, ContributionRecord> records;
  std::vector<ContributedPhoto> photos;
  uint32_t last_number = 0;
};

Status ReadEntry(std::string_view key, std::string_view value, StoredContributions* stored) {
  if (key == LastContributionKey()) return DecodeU32(value, &stored->last_number);
  if (key.starts_with(ContributionPrefix())) {
    ContributionRecord record;
    VEDUTA_RETURN_IF_ERROR(ParseContributionKey(key, &record));
    VEDUTA_RETURN_IF_ERROR(Decode(value, &record));
    stored->records[record.number] = std::move(record);
    return Status::Ok();
  }
  // CheckUploads reads those that arrive in parts.
  PartialUploadId partial{};
  if (ParsePartialUploadKey(key, &partial).ok()) return Status::Ok();
  ContributedPhoto photo;
  VEDUTA_RETURN_IF_ERROR(ParseContributedPhotoKey(key, &photo));
  VEDUTA_RETURN_IF_ERROR(Decode(value, &photo));
  stored->photos.push_back(std::move(photo));
  return Status::Ok();
}

std::string NameOf(uint32_t number) {
  return "contribution " + std::to_string(number);
}

bool Waits(const Snapshot& snapshot, const ContributedPhoto& photo) {
  const Result<UploadRecord> upload = snapshot.GetUpload(photo.upload);
  // One that cannot be read has been told.
  return upload.ok() ? upload->contribution == photo.contribution
                     : upload.status().code() != StatusCode::kNotFound;
}

}  // namespace

Status CheckContributions(const CheckedCity& city, Violations* violations) {
  StoredContributions stored;
  const auto take = [&](std::string_view key, std::string_view value) {
    const Status read = ReadEntry(key, value, &stored);
    if (!read.ok()) violations->Add(PlaceOf(Family::kContributions, key) + ": " + read.message());
  };
  VEDUTA_RETURN_IF_ERROR(WalkStored(city.snapshot, Family::kContributions, violations, take));
  std::map<uint32_t, uint64_t> counts;
  for (const ContributedPhoto& photo : stored.photos) {
    ++counts[photo.contribution];
    violations->Expect(stored.records.contains(photo.contribution), [&] {
      return NameOf(photo.contribution) + " has a photo, and nothing else is known of it";
    });
    if (photo.fate != ContributionFate::kWaiting) continue;
    violations->Expect(Waits(city.snapshot, photo), [&] {
      return NameOf(photo.contribution) + " waits for upload " + std::to_string(photo.upload) +
             ", which does not wait";
    });
  }
  for (const auto& [number, record] : stored.records) {
    violations->Expect(counts[number] <= record.photo_count, [&, number = number] {
      return NameOf(number) + " has more photos than were counted";
    });
    violations->Expect(number <= stored.last_number, [&, number = number] {
      return NameOf(number) + " has a number that was not given yet";
    });
  }
  return Status::Ok();
}

}  // namespace veduta
