// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a vocabulary finds among photos whose true neighbours are known, and what it costs.

#include <string>
#include <vector>

#include "index/vocabulary_trainer.h"
#include "tools/bench/retrieval/photo_sets.h"

namespace veduta::bench {

struct Shape {
  uint32_t branch = 10, levels = 7;
  uint32_t sample = 500'000;          // descriptors, at most
  uint32_t descriptors_per_leaf = 0;  // 0: as OptionsForSample says
  uint32_t attempts = 0;              // runs of k-means per node; 0: as OptionsForSample says
};

// "BRANCH,LEVELS,SAMPLE[,DESCRIPTORS_PER_LEAF[,ATTEMPTS]]".
Result<Shape> ParseShape(const std::string& text);

// Of a query by each photo of a set that has neighbours, against all photos but itself.
struct SetRecall {
  uint32_t query_count = 0;
  std::vector<double> first_k_right;    // share of queries with a neighbour among the first k
  std::vector<double> neighbors_found;  // share of all neighbours among the first k, mean
};

struct Recall {
  std::vector<SetRecall> sets;      // one for each set of the photos
  double query_ms_median = 0;       // words to ranked images, lists in memory
  double quantize_ms_median = 0;    // descriptors to words
  double words_mean = 0;            // distinct ones of a photo
  double shared_with_neighbor = 0;  // words, mean
  double shared_with_other = 0;     // words, mean over pairs that are no neighbours
};

// The k of first_k_right and neighbors_found.
inline constexpr uint32_t kRanks[] = {1, 5, 10, 24, 50, 100};

struct TrainedShape {
  VocabularyInfo info;
  double train_s = 0, peak_mb = 0;  // above what the process held before
  double distortion_mean = 0;
  Recall recall;
};

// Trains from the photos of `training`, and asks among `photos`.
Result<TrainedShape> MeasureShape(const Photos& training, const Photos& photos, const Shape& shape,
                                  ThreadPool* pool);

}  // namespace veduta::bench
