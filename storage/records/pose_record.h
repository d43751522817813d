// SPDX-License-Identifier: Apache-2.0
#pragma once
// Families `poses` and `observations`, by ImageKey (image_record.h). FORMAT.md, section
// "pose_record".

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/points.h"
#include "storage/model/reconstruction.h"

namespace veduta {

Status Check(const PoseRecord& pose);
Result<std::string> Encode(const PoseRecord& pose);
Status Decode(std::string_view value, ImageId image, PoseRecord* pose);

Status Check(std::span<const Observation> observations);
Result<std::string> Encode(std::span<const Observation> observations);
Status Decode(std::string_view value, std::vector<Observation>* observations);

}  // namespace veduta
