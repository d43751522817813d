// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `images`, and the families `names` and `hashes` that find an image. FORMAT.md, section
// "image_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/image.h"

namespace veduta {

// The key of `names` is the name itself, that of `hashes` HashKey (photo_record.h); the value of
// both is a u32, the image.
std::string ImageKey(ImageId id);

Status Check(const ImageRecord& image);
Result<std::string> Encode(const ImageRecord& image);
Status Decode(std::string_view value, ImageId id, ImageRecord* image);

}  // namespace veduta
