// SPDX-License-Identifier: Apache-2.0
// Photos that wait for their turn: each is whole, and has a number that was given.
#include <map>

#include "engine/query/checked_city.h"
#include "engine/query/stored_records.h"
#include "storage/records/upload_record.h"

namespace veduta {
namespace {

struct StoredUploads {
  std::map<uint64_t, UploadRecord> records;
  std::map<uint64_t, ContentHash> photos;  // as they lie there
  uint64_t last_number = 0;
};

Status ReadEntry(std::string_view key, std::string_view value, StoredUploads* stored) {
  UploadEntry entry{};
  uint64_t number = 0;
  VEDUTA_RETURN_IF_ERROR(ParseUploadKey(key, &entry, &number));
  switch (entry) {
    case UploadEntry::kRecord:
      return Decode(value, number, &stored->records[number]);
    case UploadEntry::kBytes:
      stored->photos[number] =
          HashContent({reinterpret_cast<const uint8_t*>(value.data()), value.size()});
      return Status::Ok();
    case UploadEntry::kLastNumber:
      break;
  }
  return DecodeLastUpload(value, &stored->last_number);
}

std::string NameOf(uint64_t number) {
  return "upload " + std::to_string(number);
}

}  // namespace

Status CheckUploads(const CheckedCity& city, Violations* violations) {
  StoredUploads stored;
  const auto take = [&](std::string_view key, std::string_view value) {
    const Status read = ReadEntry(key, value, &stored);
    if (!read.ok()) violations->Add(PlaceOf(Family::kUploads, key) + ": " + read.message());
  };
  VEDUTA_RETURN_IF_ERROR(WalkStored(city.snapshot, Family::kUploads, violations, take));
  for (const auto& [number, upload] : stored.records) {
    const auto photo = stored.photos.find(number);
    violations->Expect(photo != stored.photos.end() && photo->second == upload.photo,
                       [&, number = number] { return NameOf(number) + " has not its photo"; });
    violations->Expect(number <= stored.last_number, [&, number = number] {
      return NameOf(number) + " has a number that was not given yet";
    });
  }
  for (const auto& [number, photo] : stored.photos) {
    violations->Expect(stored.records.contains(number), [&, number = number] {
      return NameOf(number) + " has a photo, and nothing else is known of it";
    });
  }
  return Status::Ok();
}

}  // namespace veduta
