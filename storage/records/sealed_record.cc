// SPDX-License-Identifier: Apache-2.0
#include "storage/records/sealed_record.h"

#include "storage/records/key_bytes.h"
#include "storage/records/photo_record.h"
#include "storage/records/upload_record.h"

namespace veduta {

std::string SealedKey(const ContentHash& original) {
  return std::string(kSealedPrefix) + HashKey(original);
}

bool ParseSealedKey(std::string_view key, ContentHash* original) {
  return key.starts_with(kSealedPrefix) && ParseHashKey(key.substr(kSealedPrefix.size()), original);
}

std::string OriginalPrefix() {
  return TaggedKey(static_cast<uint8_t>(UploadEntry::kOriginal), "");
}

std::string OriginalKey(ImageId image) {
  return OriginalPrefix() + Key32(image.value);
}

bool ParseOriginalKey(std::string_view key, ImageId* image) {
  const std::string prefix = OriginalPrefix();
  return key.starts_with(prefix) && ParseId(key.substr(prefix.size()), &image->value).ok();
}

}  // namespace veduta
