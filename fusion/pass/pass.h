// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the stages of the offline pass share. Each stage looks at every artefact of its kind,
// compares the version that it would get with the one stored, makes what is stale, and commits it
// piece by piece: whoever kills the process loses the piece at hand, and the next pass goes on from
// there to the same bytes.

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "fusion/pass/densify.h"
#include "fusion/pass/scene.h"
#include "fusion/volume/grid.h"
#include "storage/base/content_feed.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

class Device;

// Part of every version: raise it when an algorithm or a constant behind a stored artefact changes.
inline constexpr uint64_t kPassVersion = 1;

struct Pass {
  Database& database;
  const Scene& scene;
  const DenseSettings settings;
  Device* device;  // null: C++
  ThreadPool& pool;
  const DensifyOptions& options;
  std::stop_token stop;

  VolumeGrid grid() const { return {.voxel_size = settings.voxel_size}; }
  // Tells how far a stage is; kCancelled when somebody asked to stop.
  Status Tell(std::string_view stage, size_t done, size_t total) const;
};

// What an artefact is made from, fed piece by piece; its version is 64 bits of the hash, and never
// 0, which stands for "none".
class VersionFeed final : public ContentFeed {
 public:
  explicit VersionFeed(const std::string& stage);
  uint64_t Version();  // once
};

// The stages, in their order.
// Raw depth maps; `without_depth` receives the photos that get none.
Result<StageCount> UpdateDepths(const Pass& pass, std::vector<PassedOver>* without_depth);
Result<StageCount> CheckDepths(const Pass& pass);      // against each other
Result<StageCount> UpdateVolume(const Pass& pass);     // histograms of tiles
Result<StageCount> SolveTiles(const Pass& pass);       // the fused signed distance
Result<StageCount> ExtractTiles(const Pass& pass);     // triangles
Result<StageCount> UpdateExposures(const Pass& pass);  // a gain a photo
Result<StageCount> ColorTiles(const Pass& pass);
Status SweepStale(const Pass& pass);  // maps of this reconstruction that nothing names any more

}  // namespace veduta
