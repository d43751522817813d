// SPDX-License-Identifier: Apache-2.0
#pragma once
// What came of photos that were stored with filled areas, in the family `uploads`, and which image
// has it, in `meta`. FORMAT.md, section "sealed_record".

#include <string>
#include <string_view>

#include "storage/base/content_hash.h"
#include "storage/base/ids.h"

namespace veduta {

inline constexpr std::string_view kSealedPrefix = "sealed/";  // of keys of `meta`

std::string SealedKey(const ContentHash& original);  // of `meta`; the value is the image, u32
bool ParseSealedKey(std::string_view key, ContentHash* original);

std::string OriginalKey(ImageId image);  // of `uploads`; the value is the bytes as they came
std::string OriginalPrefix();            // of all of these
bool ParseOriginalKey(std::string_view key, ImageId* image);

}  // namespace veduta
