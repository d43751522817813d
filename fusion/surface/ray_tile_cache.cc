// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/ray_tile_cache.h"

#include <utility>

namespace veduta {

RayTileCache::RayTileCache(std::shared_ptr<const RayDevice> device, Load load,
                           size_t size_bytes_max)
    : device_(std::move(device)), load_(std::move(load)), tiles_(size_bytes_max) {}

Result<std::shared_ptr<const RayTile>> RayTileCache::Get(uint64_t tile) {
  const auto make = [&]() -> Result<std::shared_ptr<const RayTile>> {
    ++load_count_;
    VEDUTA_ASSIGN_OR_RETURN(TriangleMesh mesh, load_(tile));
    return RayTile::Make(device_, std::move(mesh));
  };
  return tiles_.GetOrMake(tile, make, [](const auto& made) { return made->size_bytes(); });
}

}  // namespace veduta
