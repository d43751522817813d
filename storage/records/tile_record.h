// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `dense`, entry 4: a tile and the versions of its parts. Families `volume` (histograms of a
// block) and `surface` (solution, mesh, colors, first round), which fusion/ serializes. FORMAT.md,
// section "tile_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/dense.h"

namespace veduta {

std::string TilePrefix(ReconstructionId reconstruction);
std::string TileKey(ReconstructionId reconstruction, GridPlace place);
Status ParseDenseKey(std::string_view key, ReconstructionId* reconstruction, GridPlace* place);

std::string VolumePrefix(ReconstructionId reconstruction);
std::string VolumePrefix(ReconstructionId reconstruction, GridPlace tile);
std::string VolumeKey(ReconstructionId reconstruction, GridPlace tile, uint8_t block);

std::string SurfacePrefix(SurfacePart part, ReconstructionId reconstruction);
std::string SurfaceKey(SurfacePart part, ReconstructionId reconstruction, GridPlace tile);

// Decode: the caller has set what the key says, reconstruction and place.
Status Check(const TileRecord& tile);
Result<std::string> Encode(const TileRecord& tile);
Status Decode(std::string_view value, TileRecord* tile);

}  // namespace veduta
