// SPDX-License-Identifier: Apache-2.0
#pragma once
// Queries against a stored index of a city that does not exist: words are drawn by the statistics
// that real photos have, so that the size may be any.

#include <string>

#include "storage/base/status.h"

namespace veduta::bench {

struct SyntheticCity {
  uint32_t image_count = 10'000;
  uint32_t word_count = 700'000;      // of the vocabulary
  double words_of_image = 2000;       // distinct ones, mean
  double shared_with_other = 5;       // words that two unrelated images share, mean
  double shared_with_neighbor = 200;  // words that two views of one place share, mean
  uint32_t neighbor_count = 8;        // of each query; R22 of docs/paper.md
  uint32_t query_count = 50;
  uint64_t cache_bytes = 256ull << 20;  // DatabaseOptions::block_cache_bytes
  uint64_t seed = 1;
};

struct QueryCost {
  double lookup_ms_median = 0, rank_ms_median = 0;  // lists from the database, then their scores
  double query_ms_first = 0;                        // the first query after opening
  double query_ms_median = 0, query_ms_worst = 0;   // both together, without the first query
  double processor_ms_median = 0;                   // of both, time of one core
  double first_right = 0;            // share of queries whose best other image is a neighbour
  double postings_read = 0;          // images in the lists of one query, mean
  double peak_mb = 0;                // of the process while it asks
  double build_s = 0, index_mb = 0;  // the lists that were written, on disk
  bool all_lists = false;            // or those of the queries' words alone
};

// Builds the index in `folder`, which must not exist, and asks. Where all lists would hold more
// than lists_max ids, only those are written that a query asks for.
Result<QueryCost> MeasureQueries(const SyntheticCity& city, const std::string& folder,
                                 double lists_max);

}  // namespace veduta::bench
