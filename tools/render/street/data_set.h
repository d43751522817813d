// SPDX-License-Identifier: Apache-2.0
#pragma once
// Renders a whole set of photos into a folder: photos/, truth/, camera.txt, README, scene.ply.

#include <functional>
#include <string>
#include <vector>

#include "tools/render/street/camera_rig.h"

namespace veduta::street {

struct DataSetOptions {
  SceneOptions scene;
  RigOptions rig;
  RenderOptions render;   // its seed is mixed with the photo's number
  int jpeg_quality = 92;  // [1, 100]
  bool mesh = false;      // with scene.ply
  double gps_m = 0;       // [0, 1000]; above 0: EXIF with GPS of this standard deviation
  uint32_t threads = 1;   // [1, 256]; one photo per thread; the bytes do not depend on it
  std::string command;    // for the README: how to make the same again

  Status Check() const;
};

// JPEG (4:4:4, so that colour stays where it was). kInvalidArgument on an empty photo, kIoError if
// the encoder fails.
Result<std::vector<uint8_t>> EncodeJpeg(const StreetPhoto& photo, int quality);

// Writes the data set. `progress` is called with the number of photos done, from any thread, one
// call at a time; an empty function is fine.
//
// kInvalidArgument on bad options; kAlreadyExists if the folder is not empty; kIoError with the
// path.
Status RenderStreet(const DataSetOptions& options, const std::string& folder,
                    const std::function<void(size_t)>& progress);

}  // namespace veduta::street
