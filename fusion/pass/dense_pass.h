// SPDX-License-Identifier: Apache-2.0
#pragma once
// The dense pass: it makes depth maps, a fused volume and a coloured surface from the photos of a
// reconstruction, all of it in the database. It makes anew what is stale and leaves the rest.

#include <cstdint>

#include "engine/door/dense.h"
#include "engine/writer/writer.h"
#include "fusion/pass/dense_pass_tools.h"
#include "storage/base/status.h"

namespace veduta {

// Every piece (a depth map, a tile) is computed from a snapshot without a turn, and committed in a
// turn of its own, so others may write between two pieces. The pass works on the poses and points
// that the reconstruction had when it began: what photos change that are added meanwhile is stale
// afterwards, and the next pass makes it anew. Only one pass may run on a database at a time.
//
// After a crash or a stop (kCancelled) the next call goes on, to the same bytes. Deterministic at
// any number of threads. Memory: the sparse points, views or depth maps and meshes
// (DensePassTools::cache_bytes), one tile with its surroundings, the tiles that one tile is
// coloured among; for the area, some 100 bytes for each tile and 30 for each block.
//
// A reconstruction that is merged away while the pass runs is no error: the report says where it
// went, and the next SweepMerged deletes what the pass had made. kNotFound, kInvalidArgument: as
// LoadScene; bad options. Other errors: of the database, the device, a damaged photo.
Result<DensifyReport> RunDensePass(const DensePassTools& tools, ReconstructionId reconstruction,
                                   const DensifyOptions& options);

// Deletes what belongs to reconstructions that were merged away. Returns how many of these had
// something.
Result<uint64_t> SweepMerged(Writer& writer);

}  // namespace veduta
