// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that wait for their turn in family `uploads`. The functions are those of Database, on its
// files; each is one write of its own.

#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/status.h"
#include "storage/database_files.h"
#include "storage/model/contribution.h"
#include "storage/model/upload.h"
#include "storage/value_reader.h"
#include "storage/write_buffer.h"

namespace veduta {

// One call at a time.
Result<uint64_t> AddUpload(DatabaseFiles& files, UploadRecord upload,
                           std::span<const uint8_t> bytes, bool sync);
Status NameUploadCamera(DatabaseFiles& files, uint64_t number, const std::string& camera,
                        bool sync);
Status DeleteUpload(DatabaseFiles& files, uint64_t number, const ContributedPhoto* fate);
// What AddUpload writes, into a batch; gives the upload the next number where it has none.
Status PutUpload(DatabaseFiles& files, UploadRecord* upload, std::span<const uint8_t> bytes,
                 WriteBuffer* batch);
// Snapshot::ListUploads.
Result<std::vector<UploadRecord>> ListUploads(const ValueReader& reader);

}  // namespace veduta
