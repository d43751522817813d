// SPDX-License-Identifier: Apache-2.0
#pragma once
// The journal's entry of a camera. It has the intrinsics, for nothing else in the database tells
// them should the camera's record be damaged.

#include <optional>
#include <string>

#include "storage/model/camera.h"
#include "storage/transaction.h"

namespace veduta {

// "NAME (camera ID): WIDTHxHEIGHT PARAMS[ from PARAMS][ refinable]", where PARAMS are
// fx,fy,cx,cy[,k1,k2[,u0,v0]], and those that come second are of CameraRecord::refined_from.
std::string CameraEntry(const CameraRecord& camera);
// Writes a new camera with its entry.
void PutNewCamera(const CameraRecord& camera, DatabaseState* state, Transaction* transaction);
// The camera that an entry describes, without its source. None for an entry of an older program:
// that is the name alone.
std::optional<CameraRecord> ParseCameraEntry(const std::string& entry);

}  // namespace veduta
