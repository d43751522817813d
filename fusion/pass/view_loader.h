// SPDX-License-Identifier: Apache-2.0
#pragma once
// Stored photos as the offline pass wants them: upright, without their lens, of the size asked for.

#include <list>
#include <memory>

#include "engine/camera/undistorter.h"
#include "fusion/pass/scene.h"
#include "storage/database.h"
#include "storage/model/view.h"

namespace veduta {

// Camera and size of the view that is made of a photo: undistorted; without the border where a lens
// makes the undistorted image look past the photo; its longer side `side_px` (0: as it is; never
// larger). The pose is the image's. Deterministic, thread-safe.
ViewGeometry ViewGeometryOf(const SceneImage& image, uint32_t side_px);

// Not thread-safe. Keeps the views last asked for.
class ViewLoader final {
 public:
  // side_px as above; view_count_max >= 1 views are kept, 4 bytes a pixel each.
  ViewLoader(std::shared_ptr<const Snapshot> snapshot, uint32_t side_px, size_t view_count_max)
      : snapshot_(std::move(snapshot)),
        side_px_(side_px),
        view_count_max_(view_count_max),
        tables_(256ull << 20) {}

  // With gray and rgb. kCorruption, naming the photo, when it cannot be decoded any more.
  Result<std::shared_ptr<const View>> Load(const SceneImage& image);

  const Snapshot& snapshot() const { return *snapshot_; }

 private:
  Result<View> Make(const SceneImage& image);

  const std::shared_ptr<const Snapshot> snapshot_;
  const uint32_t side_px_;
  const size_t view_count_max_;
  UndistortCache tables_;
  std::list<std::shared_ptr<const View>> views_;  // newest first
};

}  // namespace veduta
