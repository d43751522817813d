// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/undistorted_photos.h"

#include <cstdio>
#include <filesystem>

#include "fusion/pass/view_loader.h"
#include "fusion/surface/renderer.h"

namespace veduta {

Result<std::map<ImageId, UndistortedPhoto>> WriteUndistorted(const Snapshot& snapshot,
                                                             const Scene& scene,
                                                             const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directory(folder + "/images", error);
  if (error) return Status::IoError("cannot make folder " + folder + "/images: " + error.message());
  // The caller's snapshot outlives this: nothing is shared.
  ViewLoader loader(std::shared_ptr<const Snapshot>(std::shared_ptr<const Snapshot>(), &snapshot),
                    0, 1);
  std::map<ImageId, UndistortedPhoto> photos;
  for (const auto& [id, image] : scene.images) {
    VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const View> view, loader.Load(image));
    char path[32];
    std::snprintf(path, sizeof(path), "images/%06u.png", id.value);
    VEDUTA_RETURN_IF_ERROR(WritePng(folder + "/" + path, view->geometry.width_px,
                                    view->geometry.height_px, view->rgb));
    photos[id] = {path, view->geometry};
  }
  return photos;
}

}  // namespace veduta
