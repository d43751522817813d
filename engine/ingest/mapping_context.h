// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every step of mapping works on.

#include "engine/ingest/map_loader.h"
#include "engine/ingest/mapper_options.h"
#include "engine/mapping/city_map.h"
#include "engine/mapping/repetition.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// All of them must outlive this struct. `loader` loads into `map`.
struct MappingContext {
  MapLoader* loader;
  CityMap* map;
  ThreadPool* pool;
  const MapperOptions& options;
  RepetitionMemory* repetitions = nullptr;  // may be null
};

}  // namespace veduta
