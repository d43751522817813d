// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `dense`, entries 2 and 3: the newest depth map of an image, and checked depth maps. Family
// `depth`: their pixels, under the same keys. FORMAT.md, section "depth_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/dense.h"

namespace veduta {

std::string DepthKey(ImageId image);
std::string CheckedDepthKey(ImageId image, uint64_t version);
Status ParseDenseKey(std::string_view key, ImageId* image);
Status ParseDenseKey(std::string_view key, ImageId* image, uint64_t* version);

// Decode: the caller has set what the key says, image and version.
Status Check(const DepthRecord& depth);
Result<std::string> Encode(const DepthRecord& depth);
Status Decode(std::string_view value, DepthRecord* depth);

Status Check(const CheckedDepthRecord& depth);
Result<std::string> Encode(const CheckedDepthRecord& depth);
Status Decode(std::string_view value, CheckedDepthRecord* depth);

Status Check(const DepthPixels& pixels);
Result<std::string> Encode(const DepthPixels& pixels);
Status Decode(std::string_view value, DepthPixels* pixels);

}  // namespace veduta
