// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras as people type them: `WxH` and `fx,fy,cx,cy[,k1,k2[,u0,v0]]`. Independent of the locale.

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/camera.h"
#include "storage/model/image_size.h"

namespace veduta {

// "1536x1024": two whole numbers in 1..65535 with a small x between them, nothing else.
// kInvalidArgument otherwise.
Result<ImageSize> ParseSize(std::string_view text);

// "fx,fy,cx,cy", with ",k1,k2" for radial distortion and ",u0,v0" for a centre of distortion that
// is not (cx, cy); px and normalised coordinates as in CameraModel. No spaces. The model returned
// has passed CheckCamera. kInvalidArgument names the field that is wrong.
Result<CameraModel> ParseCameraParams(std::string_view text, ImageSize size);

// The shortest text that ParseCameraParams reads back as the same model.
std::string CameraParamsText(const CameraModel& model);

}  // namespace veduta
