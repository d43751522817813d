// SPDX-License-Identifier: Apache-2.0
#pragma once
// How one amount of memory is divided between all in the daemon that has a bound.

#include <cstdint>

#include "storage/base/status.h"

namespace veduta {

// Each field is what the bound of the same name may be.
struct MemoryDivision {
  // Of the engine (EngineOptions): photos that are prepared, and what is kept to be read again.
  uint64_t prepare_memory_bytes = 0;
  uint64_t block_cache_bytes = 0, feature_cache_bytes = 0, undistort_cache_bytes = 0;
  uint64_t surface_cache_bytes = 0;
  // Of the doors (HttpDoorOptions, RpcDoorOptions): bodies that arrive or wait, answers that are
  // being sent, and both of RPC.
  uint64_t bodies_bytes_max = 0, answers_bytes_max = 0, rpc_bytes_max = 0;
};

// In sixteenths of `bytes`: 4 to prepare photos and for pieces of the dense pass, 2 of the files'
// blocks, 2 of features, 1 of lenses' tables, 1 of surfaces, 2 each of bodies, of answers and of
// RPC. Chosen by hand: by 4 GiB the tables and the last three are what the daemon takes by itself.
// kInvalidArgument, with the least that works, below 1 GiB: a sixteenth is 64 MiB then, and a body
// may have 128 MiB.
Result<MemoryDivision> DivideMemory(uint64_t bytes);

}  // namespace veduta
