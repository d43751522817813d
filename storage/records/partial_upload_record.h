// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that arrive in parts: records in family `contributions`, pieces in family `uploads`, where
// they may be as large as they are. FORMAT.md, section "partial_upload_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/partial_upload.h"

namespace veduta {

// Those that have arrived lie apart from those that are on their way.
std::string PartialUploadKey(const PartialUploadId& id, bool has_arrived = false);
std::string PartialUploadPrefix(bool has_arrived = false);  // of all keys of records
std::string PieceKey(const PartialUploadId& id, uint32_t number);
// kCorruption for any other key; of a piece `number` is filled as well. The former takes either
// kind of record.
Status ParsePartialUploadKey(std::string_view key, PartialUploadId* id);
Status ParsePieceKey(std::string_view key, PartialUploadId* id, uint32_t* number);

Status Check(const PartialUploadRecord& partial);
Result<std::string> Encode(const PartialUploadRecord& partial);
// `partial` has its id already.
Status Decode(std::string_view value, PartialUploadRecord* partial);

}  // namespace veduta
