// SPDX-License-Identifier: Apache-2.0
#pragma once
// Trains a vocabulary tree by hierarchical k-means: section 3.1 of the paper (R8).

#include <cstdint>
#include <span>
#include <stop_token>

#include "index/vocabulary_tree.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

struct VocabularyTrainerOptions {
  uint32_t branch = 10;    // [2, 64] children of a node at most; R8
  uint32_t depth_max = 7;  // [1, 7] levels; R8
  // [1, 64] runs of k-means per node, of which the one of lowest distortion is kept. R8 says
  // "several".
  uint32_t attempts_per_node = 3;
  // [1, 1000] rounds of k-means; more of them gain under 1 % of distortion.
  uint32_t iterations_max = 11;
  // >= 1: a node of n descriptors is split into min(branch, n / this) children, if that is two or
  // more. See OptionsForSample.
  uint32_t descriptors_per_leaf = 2;
  // >= 1000: a node's k-means sees this many descriptors at most; all are then assigned. Chosen by
  // hand; not measured.
  uint32_t node_sample_max = 20'000;
  uint64_t seed = 1;  // any; mixed with the sample's content

  Status Check() const;  // the first violated bound, named with its value
};

// What ranked best on 569 real photos (the command is not recorded): with few descriptors, nearly
// every one is its own word, for more words rank better; from some 300,000 descriptors on, a word
// has two, so that the views of one spot share words.
VocabularyTrainerOptions OptionsForSample(size_t descriptor_count);

struct TrainedVocabulary {
  VocabularyTree tree;
  double distortion_mean =
      0;  // squared distance from a training descriptor to its leaf's centre, mean
};

// descriptors [n x 128], n < 2^32: a sample of those that will be quantised, see DescriptorSample.
//
// Nodes, attempts and, where a node is large, its descriptors are spread over the pool. The tree is
// the same on any number of threads and on any processor: all sums are integers, and each node's
// seed comes from the options, the sample's hash and the node's place. O(n * branch * depth *
// attempts * iterations) time at most. Scratch: some 20 bytes for each descriptor, one node's
// sample for each thread, and the tree twice. Thread-safe. kInvalidArgument: bad options, a size
// that is no multiple of 128, fewer than two distinct descriptors. kCancelled where it is stopped,
// after the nodes at hand.
Result<TrainedVocabulary> TrainVocabulary(std::span<const uint8_t> descriptors,
                                          const VocabularyTrainerOptions& options, ThreadPool& pool,
                                          const std::stop_token& stop = {});

}  // namespace veduta
