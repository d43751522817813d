// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which stored images look like a photo that is not stored.

#include <span>
#include <vector>

#include "engine/photo/image_features.h"
#include "engine/retrieval/retrieval.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

// The `count_max` images that look most like the features, best first: by the vocabulary; without
// one, by the share of the features that have a mutual nearest neighbour passing the ratio test.
// Thread-safe. With a vocabulary the cost is that of the postings of its words, without one that of
// matching with every image (such a database is young).
Result<std::vector<RankedImage>> RankFeatures(const Snapshot& snapshot, const Features& features,
                                              uint32_t count_max, Retrieval* retrieval,
                                              ImageFeatureCache* cache, ThreadPool* pool);

}  // namespace veduta
