// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `cameras`. FORMAT.md, section "camera_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/camera.h"

namespace veduta {

std::string CameraKey(CameraId id);

Status Check(const CameraRecord& camera);
Result<std::string> Encode(const CameraRecord& camera);
Status Decode(std::string_view value, CameraId id, CameraRecord* camera);

}  // namespace veduta
