// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tiles that were last asked for, so that a city's tiles pass through bounded memory.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "fusion/surface/ray_scene.h"
#include "storage/base/lru_cache.h"

namespace veduta {

// Thread-safe. What is in a scene stays alive with it, also after it has left the cache.
class RayTileCache final {
 public:
  using Load = std::function<Result<TriangleMesh>(uint64_t tile)>;

  // load            reads the mesh of a tile; called without the lock, from any thread, for one
  // tile perhaps twice. size_bytes_max  of all tiles kept; the last one asked for stays in any
  // case.
  RayTileCache(std::shared_ptr<const RayDevice> device, Load load, size_t size_bytes_max);

  // The tile, from memory or loaded. Errors: those of `load` and of RayTile::Make.
  Result<std::shared_ptr<const RayTile>> Get(uint64_t tile);
  // Forgets a tile that has changed.
  void Drop(uint64_t tile) { tiles_.Erase(tile); }

  size_t size_bytes() const { return tiles_.cost(); }
  size_t load_count() const { return load_count_; }  // how often `load` was called

 private:
  const std::shared_ptr<const RayDevice> device_;
  const Load load_;
  LruCache<uint64_t, std::shared_ptr<const RayTile>> tiles_;  // by their bytes
  std::atomic<size_t> load_count_ = 0;
};

}  // namespace veduta
