// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tiles that were last asked for, so that a city's tiles pass through bounded memory.

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "fusion/surface/ray_scene.h"

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
  void Drop(uint64_t tile);

  size_t size_bytes() const;
  size_t load_count() const;  // how often `load` was called

 private:
  struct Entry {
    uint64_t tile;
    std::shared_ptr<const RayTile> value;
  };

  const std::shared_ptr<const RayDevice> device_;
  const Load load_;
  const size_t size_bytes_max_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // newest first
  std::unordered_map<uint64_t, std::list<Entry>::iterator> where_;
  size_t size_bytes_ = 0, load_count_ = 0;
};

}  // namespace veduta
