// SPDX-License-Identifier: Apache-2.0
#pragma once
// Stored photos as the dense pass wants them: upright, without their lens, of the size asked for.

#include <cstdint>
#include <memory>
#include <utility>

#include "engine/camera/decoder.h"
#include "engine/camera/undistorter.h"
#include "fusion/pass/scene.h"
#include "storage/base/lru_cache.h"
#include "storage/database.h"
#include "storage/model/view.h"

namespace veduta {

// Part of the version of every depth map and colour: raise it whenever a change of the code changes
// a View (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kViewVersion = 1;

// Camera and size of the view that is made of a photo: undistorted; without the border where a lens
// makes the undistorted image look past the photo; its longer side `side_px` (0: as it is; never
// larger). The pose is the image's. Deterministic, thread-safe.
ViewGeometry ViewGeometryOf(const SceneImage& image, uint32_t side_px);

// Not thread-safe. Keeps the views that were asked for last.
class ViewLoader final {
 public:
  // side_px as above; view_count_max >= 1 views are kept, 4 bytes for each of their pixels. The
  // decoder must outlive the loader.
  ViewLoader(std::shared_ptr<const Snapshot> snapshot, uint32_t side_px, size_t view_count_max,
             const PhotoDecoder& decoder = DecoderInProcess())
      : snapshot_(std::move(snapshot)),
        side_px_(side_px),
        tables_(256ull << 20),
        views_(view_count_max),
        decoder_(decoder) {}

  // With gray and rgb. kCorruption, naming the photo, when it cannot be decoded any more.
  Result<std::shared_ptr<const View>> Load(const SceneImage& image);

  const Snapshot& snapshot() const { return *snapshot_; }

 private:
  Result<View> Make(const SceneImage& image);

  const std::shared_ptr<const Snapshot> snapshot_;
  const uint32_t side_px_;
  UndistortCache tables_;
  LruCache<uint32_t, std::shared_ptr<const View>> views_;  // by image
  const PhotoDecoder& decoder_;
};

}  // namespace veduta
