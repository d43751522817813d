// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the stages of the dense pass share. Each stage looks at every artefact of its kind, compares
// the version that it would get now with the one that is stored, makes what is stale, and commits
// it piece by piece: when the process is killed, only the piece at hand is lost, and the next pass
// goes on from there to the same bytes.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "engine/door/dense.h"
#include "fusion/pass/dense_pass_tools.h"
#include "fusion/pass/scene.h"
#include "fusion/pass/stage_options.h"
#include "storage/base/content_feed.h"
#include "storage/database.h"

namespace veduta {

class DensePass final {
 public:
  // Both must outlive the pass.
  DensePass(const DensePassTools& tools, const Scene& scene)
      : tools_(tools), scene_(scene), surface_(scene.reconstruction.id) {}

  const Scene& scene() const { return scene_; }
  ReconstructionId reconstruction() const { return scene_.reconstruction.id; }
  // The id that tiles go under: the reconstruction's own until another is set
  // (fusion/pass/staged_surface.h).
  ReconstructionId surface() const { return surface_; }
  void set_surface(ReconstructionId surface) { surface_ = surface; }
  ThreadPool& pool() const { return tools_.pool; }
  const ViewTools& views() const { return tools_.views; }
  // Waits for so many bytes of the memory that the pass shares with others.
  MemoryBudget::Share TakeMemory(uint64_t bytes) const;
  // What a stage may keep of views or depth maps, and of meshes.
  uint64_t map_bytes_max() const { return tools_.cache_bytes / 2; }
  uint64_t mesh_bytes_max() const { return tools_.cache_bytes / 2; }
  Device* device() const { return tools_.device; }  // null: C++
  // Whether somebody asked to stop; for what would take long until the next piece.
  const std::stop_token& stop() const { return tools_.stop; }
  Status CheckStop() const;  // kCancelled then
  std::shared_ptr<const Snapshot> GetSnapshot() const { return tools_.writer.GetSnapshot(); }

  // Tells how far a stage is; kCancelled when somebody asked to stop.
  Status Tell(std::string_view stage, size_t done, size_t total) const;

  // One piece: takes a turn, begins a transaction and then a snapshot, lets `write` fill it, and
  // commits. kCancelled, and nothing is written, when the reconstruction has been merged away or
  // dissolved: merged_into() and dissolved() tell from then on.
  using Write = std::function<Status(const Snapshot&, Transaction*)>;
  Status Commit(const Write& write);
  // The same of one tile, whose record was `as_read` (nothing: there was none) when the piece was
  // begun. Where it is another one now, the pass is overtaken.
  Status CommitTile(const std::optional<TileRecord>& as_read, const GridPlace& place,
                    const Write& write);
  // For `write`: overtaken where the depth map's record is another one now, or is gone.
  Status ExpectDepth(const Snapshot& now, const DepthRecord& as_read);
  ReconstructionId merged_into() const { return merged_into_; }
  bool dissolved() const { return dissolved_; }
  // What a piece was made from has been taken out of the reconstruction while the pass worked on
  // it: that is noted, and returned as kBusy. A new pass goes on from what is stored.
  Status NoteOvertaken();
  bool is_overtaken() const { return is_overtaken_; }

 private:
  const DensePassTools& tools_;
  const Scene& scene_;
  ReconstructionId surface_;
  ReconstructionId merged_into_;
  bool dissolved_ = false, is_overtaken_ = false;
};

// What an artefact is made from, fed piece by piece after the options and the algorithms of its
// stage; its version is 64 bits of the hash, and never 0, which stands for "none".
class VersionFeed final : public ContentFeed {
 public:
  template <typename StageOptions>
  explicit VersionFeed(const StageOptions& options) {
    *this << std::string(StageOptions::kStage);
    for (const uint32_t version : StageOptions::kAlgorithms) *this << version;
    FeedOptionFields(options, this);
  }
  uint64_t Version() { return std::max<uint64_t>(1, Finish().Seed()); }  // once
};

// The stages, in their order.

// Raw depth maps; `without_depth` receives the photos that get none.
Result<StageCount> UpdateDepths(const DepthStageOptions& options,
                                const MovementTolerance& tolerance, DensePass* pass,
                                std::vector<PassedOver>* without_depth);
// Depth maps against each other.
Result<StageCount> CheckDepths(const CheckStageOptions& options, const MovementTolerance& tolerance,
                               DensePass* pass);
// Histograms of tiles.
Result<StageCount> UpdateVolume(const VolumeStageOptions& options,
                                const BlockAllocation& allocation, DensePass* pass);
// The fused signed distance of tiles.
Result<StageCount> SolveTiles(const FusionStageOptions& options, DensePass* pass);
// Triangles of tiles.
Result<StageCount> ExtractTiles(const MeshStageOptions& options, DensePass* pass);
// One gain for each photo that has none yet.
Result<StageCount> UpdateExposures(const ExposureStageOptions& options, DensePass* pass);
// Colours of tiles.
Result<StageCount> ColorTiles(const ColorStageOptions& options, DensePass* pass);
// Deletes the checked depth maps of this reconstruction that were superseded and that no tile holds
// any more.
Status SweepStale(DensePass* pass);

}  // namespace veduta
