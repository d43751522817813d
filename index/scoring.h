// SPDX-License-Identifier: Apache-2.0
#pragma once
// How much stored images look like a query: eq 5 of the paper (R9).
//
//   score(Q, D) = (sum of w(t) over the distinct words t in both Q and D)
//               / (sum of w(t) over the distinct words t in Q),
//   w(t) = log(N / max(n(t), 1)),
//
// with N images in the collection, of which n(t) have the word t. A word that no stored image has
// counts as if one had it: it weighs the most and lowers the score of every image, for it is
// something in the query that the collection does not show. Where all weights are zero (one image
// is stored, or every image has every word) each word weighs the same instead.
//
// Weights are rounded to 2^-32 and summed as integers, so a score does not depend on the order of
// the sums, and an image that has all of the query's words, as a stored image queried with itself,
// scores exactly 1.0.

#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

struct RankOptions {
  uint32_t count_max = 100;  // [0, 2^32) images to return; R10 takes 1 % of the database
  double score_min = 0;      // [0, 1]; images below are left out, and those at zero always

  Status Check() const;  // the first violated bound, named with its value
};

struct RankedImage {
  ImageId image;
  double score = 0;  // (0, 1]

  bool operator==(const RankedImage&) const = default;
};

// Best first, equal scores by ascending id.
//
// postings[i] are the images, ascending, that contain the i-th distinct word of the query; empty
// for a word that none has. image_count is N, at least the longest list; ids may exceed it. No
// postings, no result. O(total length of the postings) time; memory O(N), or O(images found) where
// ids are much larger than N. Deterministic, thread-safe. kInvalidArgument: bad options; a list
// that does not ascend, holds id 0 or exceeds N.
Result<std::vector<RankedImage>> Rank(std::span<const std::vector<ImageId>> postings,
                                      uint32_t image_count, const RankOptions& options);

}  // namespace veduta
