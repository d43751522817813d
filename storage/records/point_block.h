// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `points`: the points that one image is home to, as columns. FORMAT.md, section
// "point_block".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/points.h"

namespace veduta {

std::string PointBlockPrefix(ReconstructionId reconstruction, uint32_t generation);
std::string PointBlockKey(ReconstructionId reconstruction, uint32_t generation, ImageId home);

Status Check(const PointBlock& block);
Result<std::string> Encode(const PointBlock& block);
Status Decode(std::string_view value, ImageId home, PointBlock* block);

}  // namespace veduta
