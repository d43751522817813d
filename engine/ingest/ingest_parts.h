// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the steps of adding photos share.

#include "engine/ingest/ingest_options.h"
#include "engine/mapping/city_map.h"
#include "engine/mapping/repetition.h"
#include "engine/photo/image_features.h"
#include "engine/retrieval/retrieval.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

// All of them must outlive this struct. Between two steps the map equals the last commit, as far as
// it is loaded, and records no change.
struct IngestParts {
  Database* database;
  Retrieval* retrieval;
  ImageFeatureCache* features;
  ThreadPool* pool;
  const IngestOptions& options;
  CityMap* map;
  RepetitionMemory* repetitions = nullptr;  // may be null

  // Forgets the map when it has grown too large: what it holds is loaded again when it is wanted.
  void TrimMap() const {
    if (map->images().size() > options.map_images_max) map->Clear();
  }
};

}  // namespace veduta
