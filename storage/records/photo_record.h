// SPDX-License-Identifier: Apache-2.0
#pragma once
// Families `photos` (the bytes as they came) and `features`, by the photo's content. FORMAT.md,
// section "photo_record".

#include <string>
#include <string_view>

#include "storage/base/content_hash.h"
#include "storage/base/status.h"
#include "storage/model/features.h"

namespace veduta {

std::string HashKey(const ContentHash& hash);
bool ParseHashKey(std::string_view key, ContentHash* hash);

Status Check(const Features& features);
Result<std::string> Encode(const Features& features);
Status Decode(std::string_view value, Features* features);

// What HashKeys begin with whose hash begins with these hexadecimal digits: their whole bytes, up
// to the first digit that is none.
std::string HashKeyPrefix(std::string_view digits);

}  // namespace veduta
