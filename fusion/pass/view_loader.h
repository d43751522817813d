// SPDX-License-Identifier: Apache-2.0
#pragma once
// Stored photos as the dense pass wants them: upright, without their lens, of the size asked for.

#include <cstdint>
#include <memory>
#include <utility>

#include "engine/camera/decoder.h"
#include "engine/camera/undistorter.h"
#include "engine/photo/memory_budget.h"
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

// What views are made with.
struct ViewTools {
  const PhotoDecoder& decoder = DecoderInProcess();
  UndistortCache* tables = nullptr;  // null: each loader has some of its own
  TakeMemory take_memory = {};       // for what a photo takes while it is made a view
};

// Not thread-safe. Keeps the views that were asked for last.
class ViewLoader final {
 public:
  // side_px as above. Views of up to view_bytes_max bytes are kept, 4 for each of their pixels, and
  // the last one in any case. What the tools refer to must outlive the loader.
  ViewLoader(std::shared_ptr<const Snapshot> snapshot, uint32_t side_px, uint64_t view_bytes_max,
             ViewTools tools = {})
      : snapshot_(std::move(snapshot)),
        side_px_(side_px),
        own_tables_(256ull << 20),
        views_(view_bytes_max),
        tools_(std::move(tools)) {}

  // With gray and rgb. kCorruption, naming the photo, when it cannot be decoded any more.
  Result<std::shared_ptr<const View>> Load(const SceneImage& image);

  const Snapshot& snapshot() const { return *snapshot_; }
  UndistortCache& tables() { return tools_.tables != nullptr ? *tools_.tables : own_tables_; }

 private:
  Result<View> Make(const SceneImage& image);

  const std::shared_ptr<const Snapshot> snapshot_;
  const uint32_t side_px_;
  UndistortCache own_tables_;
  LruCache<uint32_t, std::shared_ptr<const View>> views_;  // by image
  const ViewTools tools_;
};

}  // namespace veduta
