// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `contributions`. FORMAT.md, section "contribution_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/contribution.h"

namespace veduta {

// First byte of the key. Never renumbered.
enum class ContributionEntry : uint8_t {
  kRecord = 1,      // number
  kPhoto = 2,       // number of the contribution, then that of the upload
  kLastNumber = 3,  // nothing follows; the value is the number of the last contribution, u32
  // Of photos that arrive in parts: partial_upload_record.h.
  kPartial = 4,  // its id
  kArrived = 5,  // its id, once all of it has come
};

std::string ContributionKey(uint32_t number);
std::string ContributionPrefix();  // of all keys of records
std::string ContributedPhotoKey(uint32_t contribution, uint64_t upload);
std::string ContributedPhotoPrefix(uint32_t contribution);
std::string LastContributionKey();
// Each fills the numbers of the key; kCorruption for any other key.
Status ParseContributionKey(std::string_view key, ContributionRecord* contribution);
Status ParseContributedPhotoKey(std::string_view key, ContributedPhoto* photo);

Status Check(const ContributionRecord& contribution);
Result<std::string> Encode(const ContributionRecord& contribution);
// `contribution` has its number already.
Status Decode(std::string_view value, ContributionRecord* contribution);

Status Check(const ContributedPhoto& photo);
Result<std::string> Encode(const ContributedPhoto& photo);
// `photo` has its numbers already.
Status Decode(std::string_view value, ContributedPhoto* photo);

}  // namespace veduta
