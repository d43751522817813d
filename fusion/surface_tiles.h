// SPDX-License-Identifier: Apache-2.0
#pragma once
// Stored surfaces as tilesets: what Questions::Tileset and Questions::SurfaceTile do.
//
// A leaf is made when it is asked for, from the record of its tile: some milliseconds. The surface
// of a coarser node is made from its children's, down to the leaves, and kept in memory under its
// name; so the first one who asks for the root waits for all of the surface to be read once, and
// whoever comes after a change waits for what is above the tiles that changed. They are not stored
// with the dense pass: what is stored has to be removed, moved and checked with the tiles, and is
// made again from them in a second for a million triangles.

#include <cstdint>
#include <string>
#include <vector>

#include "engine/door/dense.h"
#include "engine/parts.h"
#include "storage/database.h"

namespace veduta {

// Errors: as Questions::Tileset.
Result<TilesetAnswer> MakeTileset(const Snapshot& snapshot, ReconstructionId id);

// Coarse surfaces are kept in `coarse`. Callers that need the same one wait for whoever makes it;
// otherwise each makes its own. Memory for each caller, besides what is kept: some meshes of each
// level of the tree. Errors: as Questions::SurfaceTile.
Result<SurfaceTileAnswer> MakeSurfaceTile(const Snapshot& snapshot, ReconstructionId id,
                                          const std::string& name, CoarseSurfaces* coarse);

}  // namespace veduta
