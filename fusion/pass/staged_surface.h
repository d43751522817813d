// SPDX-License-Identifier: Apache-2.0
#pragma once
// A surface on another grid, made beside the one that is there, so that a pass that fails or is
// killed leaves one surface that can be read: the old one or the new one.
//
// 1. Settings and tiles of the new grid are stored under StagedSurfaceOf(reconstruction), as many
//    commits as there are pieces. Readers see the old tiles.
// 2. When the new tiles are complete, one commit deletes the old ones and gives the reconstruction
//    the new settings. From then on both ids have settings of the same grid, which says that the
//    surface moves: readers take the tiles of both ids.
// 3. Tile by tile moves to the reconstruction's own id. The commit of the last step deletes the
//    staged settings.
// A pass that finds step 1 unfinished goes on with it, unless other settings are asked for; one
// that finds step 3 unfinished finishes it first.

#include <optional>

#include "fusion/pass/stage.h"
#include "fusion/pass/surface_settings.h"
#include "storage/base/status.h"
#include "storage/database.h"

namespace veduta {

// Stores the settings of the pass that begins and returns the id that its tiles go under: the
// staged one where the reconstruction has tiles on another grid. Deletes no tile but staged ones of
// a grid that is asked for no more. Works only outside of step 3.
Result<ReconstructionId> BeginSurface(const DenseSettings& settings, DensePass* pass);

// Step 2, where `pass` makes a staged surface, which is complete; nothing otherwise.
// kInvalidArgument, and the staged tiles are deleted, where they have no triangles and the old ones
// have some.
Status SwitchToStaged(DensePass* pass);

// Step 3, from wherever it is. One commit per tile, which rewrites the tile. A tile that is damaged
// is deleted instead, and the next pass makes it again. Nothing where no surface moves.
Status FinishMove(DensePass* pass);

}  // namespace veduta
