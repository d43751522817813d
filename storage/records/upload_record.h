// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `uploads`: photos that wait for their turn. FORMAT.md, section "upload_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/upload.h"

namespace veduta {

// First byte of the key. Never renumbered.
enum class UploadEntry : uint8_t {
  kRecord = 1,      // number
  kBytes = 2,       // number; the value is the photo as it came
  kLastNumber = 3,  // nothing follows; the value is the number of the last upload, u64
  // Of a photo that arrives in parts (partial_upload_record.h): its id, then the piece's number,
  // u32; the value is the bytes as they came.
  kPiece = 4,
  kOriginal = 5,  // of a photo that was stored with filled areas (sealed_record.h)
};

std::string UploadKey(uint64_t number);
std::string UploadBytesKey(uint64_t number);
std::string UploadPrefix();  // of all keys of records
std::string LastUploadKey();
// kCorruption where the key is none of the family. `number` is 0 but for kRecord and kBytes.
Status ParseUploadKey(std::string_view key, UploadEntry* entry, uint64_t* number);

Status Check(const UploadRecord& upload);
Result<std::string> Encode(const UploadRecord& upload);
Status Decode(std::string_view value, uint64_t number, UploadRecord* upload);
std::string EncodeLastUpload(uint64_t number);
Status DecodeLastUpload(std::string_view value, uint64_t* number);

}  // namespace veduta
