// SPDX-License-Identifier: Apache-2.0
#pragma once
// The dense pass: it makes depth maps, a fused volume and a coloured surface from the photos of a
// reconstruction, all of it in the database. It makes anew what is stale and leaves the rest.

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string_view>

#include "engine/door/dense.h"
#include "engine/writer/writer.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

class Device;

// Told after each piece: the stage, how many pieces it has looked at, and how many there are.
using DenseProgress = std::function<void(std::string_view stage, size_t done, size_t total)>;

// What the dense pass works with.
struct DensePassTools {
  Writer& writer;
  ThreadPool& pool;
  Device* device = nullptr;  // null: C++ on the pool. The result is the same, bit for bit.
  DenseProgress progress;    // may be empty
  std::stop_token stop;
};

// Every piece (a depth map, a tile) is computed from a snapshot without a turn, and committed in a
// turn of its own, so others may write between two pieces. The pass works on the poses and points
// that the reconstruction had when it began: what photos change that are added meanwhile is stale
// afterwards, and the next pass makes it anew. Only one pass may run on a database at a time.
//
// After a crash or a stop (kCancelled) the next call goes on, to the same bytes. Deterministic at
// any number of threads. Memory: the sparse points, some 50 views, one tile with its surroundings,
// the tiles that one tile is coloured among; for the area, some 100 bytes for each tile and 30 for
// each block.
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
