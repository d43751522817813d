// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/ray_tile_cache.h"

#include <utility>

namespace veduta {

RayTileCache::RayTileCache(std::shared_ptr<const RayDevice> device, Load load,
                           size_t size_bytes_max)
    : device_(std::move(device)), load_(std::move(load)), size_bytes_max_(size_bytes_max) {}

Result<std::shared_ptr<const RayTile>> RayTileCache::Get(uint64_t tile) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto it = where_.find(tile); it != where_.end()) {
      entries_.splice(entries_.begin(), entries_, it->second);
      return entries_.front().value;
    }
    ++load_count_;
  }
  VEDUTA_ASSIGN_OR_RETURN(TriangleMesh mesh, load_(tile));
  VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<const RayTile> made,
                          RayTile::Make(device_, std::move(mesh)));
  const std::lock_guard lock(mutex_);
  if (const auto it = where_.find(tile); it != where_.end())
    return it->second->value;  // another thread was faster
  size_bytes_ += made->size_bytes();
  entries_.push_front({tile, std::move(made)});
  where_[tile] = entries_.begin();
  while (size_bytes_ > size_bytes_max_ && entries_.size() > 1) {
    size_bytes_ -= entries_.back().value->size_bytes();
    where_.erase(entries_.back().tile);
    entries_.pop_back();
  }
  return entries_.front().value;
}

void RayTileCache::Drop(uint64_t tile) {
  const std::lock_guard lock(mutex_);
  const auto it = where_.find(tile);
  if (it == where_.end()) return;
  size_bytes_ -= it->second->value->size_bytes();
  entries_.erase(it->second);
  where_.erase(it);
}

size_t RayTileCache::size_bytes() const {
  const std::lock_guard lock(mutex_);
  return size_bytes_;
}

size_t RayTileCache::load_count() const {
  const std::lock_guard lock(mutex_);
  return load_count_;
}

}  // namespace veduta
