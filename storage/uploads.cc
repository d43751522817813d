// SPDX-License-Identifier: Apache-2.0
#include "storage/uploads.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "storage/records/upload_record.h"
#include "storage/write_buffer.h"

namespace veduta {

Result<uint64_t> AddUpload(DatabaseFiles& files, UploadRecord upload,
                           std::span<const uint8_t> bytes, bool sync) {
  uint64_t last = 0;  // 0 where none ever came
  const auto decode = [&](std::string_view value) { return DecodeLastUpload(value, &last); };
  VEDUTA_RETURN_IF_ERROR(
      ValueReader(files, nullptr).Read(Family::kUploads, LastUploadKey(), decode).status());
  if (upload.number == 0) upload.number = last + 1;
  WriteBuffer batch(files);
  batch.Put(Family::kUploads, UploadKey(upload.number), Encode(upload));
  batch.Put(Family::kUploads, UploadBytesKey(upload.number),
            std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  batch.Put(Family::kUploads, LastUploadKey(),
            std::string_view(EncodeLastUpload(std::max(last, upload.number))));
  VEDUTA_RETURN_IF_ERROR(batch.Write(sync, "take a photo into the line"));
  return upload.number;
}

Status DeleteUpload(DatabaseFiles& files, uint64_t number) {
  WriteBuffer batch(files);
  batch.Delete(Family::kUploads, UploadKey(number));
  batch.Delete(Family::kUploads, UploadBytesKey(number));
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
