// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos without their lens's distortion, for programs that know pinhole cameras alone.

#include <map>
#include <string>

#include "fusion/pass/scene.h"
#include "storage/model/view.h"

namespace veduta {

struct UndistortedPhoto {
  std::string path;       // relative to the folder: "images/000007.png"
  ViewGeometry geometry;  // of the photo in its own size
};

// Makes FOLDER/images and writes the scene's photos into it, undistorted, as PNG files. They are
// called by their numbers: any byte may be in a name. Holds one photo at a time. kIoError with the
// path; otherwise as ViewLoader::Load.
Result<std::map<ImageId, UndistortedPhoto>> WriteUndistorted(const Snapshot& snapshot,
                                                             const Scene& scene,
                                                             const std::string& folder);

}  // namespace veduta
