// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `images`, and the families `names` and `hashes` that find an image. FORMAT.md, section
// "image_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/image.h"

namespace veduta {

// The key of `names` is NameKey, that of `hashes` HashKey (photo_record.h); the value of both is a
// u32, the image.
std::string ImageKey(ImageId id);

// Contributors name their photos each for themselves. The names of one image sort by name, so that
// all images of one name are one run of keys, which starts with NamePrefix.
std::string NameKey(std::string_view name, std::string_view contributor);
std::string NamePrefix(std::string_view name);
// False where the key is none. Before format 3 it was the name alone.
bool ParseNameKey(std::string_view key, PhotoName* name);

// Whether the number is that of a verdict, or of a reason.
bool Known(Verdict verdict);
bool Known(Reason reason);

Status Check(const ImageRecord& image);
Result<std::string> Encode(const ImageRecord& image);
Status Decode(std::string_view value, ImageId id, ImageRecord* image);

}  // namespace veduta
