// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files that say what is true of a photo, written and read back.
//
// NAME.camera  Strecha's layout, text: K (3 rows, px of the photo, (0, 0) is the centre of the
// top-left pixel), a row
//              of zeros, R camera-to-world (3 rows), the camera's centre in metres, width and
//              height.
// NAME.depth   little-endian: the four bytes "VDP1", uint32 width, uint32 height, then height x
// width float32, row by
//              row: depth along the camera's z in metres of each pixel of the (distorted) photo, 0
//              where there is sky.

#include <string>

#include "storage/base/status.h"
#include "tools/render/street/photo.h"

namespace veduta::street {

struct DepthMap {
  uint32_t width_px = 0, height_px = 0;
  std::vector<float> depth;  // [height x width]
};

// All: kIoError or kCorruption with the path. The camera file keeps no distortion and no name.
Status WriteCameraFile(const StreetCamera& camera, const std::string& path);
Result<StreetCamera> ReadCameraFile(const std::string& path);
Status WriteDepthFile(const StreetPhoto& photo, const std::string& path);
Result<DepthMap> ReadDepthFile(const std::string& path);

// camera.txt: "PINHOLE W H fx F fy F cx C cy C", then "DISTORTION k1 K k2 K u0 U v0 V" and
// "PARAMS fx,fy,cx,cy,k1,k2,u0,v0", the last as `veduta camera add --params` takes it.
Status WriteIntrinsicsFile(const CameraModel& camera, const std::string& path);
Result<CameraModel> ReadIntrinsicsFile(const std::string& path);
std::string CameraParams(const CameraModel& camera);

}  // namespace veduta::street
