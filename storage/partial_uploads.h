// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that arrive in parts, in families `contributions` and `uploads`. The functions are those
// of Database, on its files; each is one write of its own. One call at a time.

#include <cstdint>
#include <span>

#include "storage/base/status.h"
#include "storage/database_files.h"
#include "storage/model/partial_upload.h"
#include "storage/model/upload.h"

namespace veduta {

Status PutPartialUpload(DatabaseFiles& files, const PartialUploadRecord& partial, bool sync);
Status AppendToPartialUpload(DatabaseFiles& files, std::span<const uint8_t> bytes, bool sync,
                             PartialUploadRecord* partial);
Status FinishPartialUpload(DatabaseFiles& files, std::span<const uint8_t> photo, bool sync,
                           UploadRecord* upload, PartialUploadRecord* partial);
Status DeletePartialUpload(DatabaseFiles& files, const PartialUploadRecord& partial);

}  // namespace veduta
