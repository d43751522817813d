// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where photos really were taken: a folder of files NAME.camera in Strecha's layout.

#include <map>
#include <string>

#include "storage/base/status.h"
#include "storage/base/transform.h"

namespace veduta::orders {

// cam_from_world by the photo's file name. A file is text: K (3 rows), a row of three zeros, R
// camera-to-world (3 rows), the camera's centre, width and height of the photo.
using Truth = std::map<std::string, Rigid3>;

// kIoError or kCorruption with the path; kNotFound where the folder holds fewer than three cameras:
// a similarity needs three.
Result<Truth> ReadTruth(const std::string& folder);

// The largest distance between two cameras. O(cameras^2).
double ExtentOf(const Truth& truth);

}  // namespace veduta::orders
