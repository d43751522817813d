// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which stored images may show what a photo shows (R9, R10), and the vocabulary that this rests on:
// none while the database is young and compares everything, then one trained from its own photos
// and trained again as it outgrows it.

#include <memory>
#include <mutex>
#include <vector>

#include "index/scoring.h"
#include "index/vocabulary_trainer.h"
#include "index/vocabulary_tree.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

struct RetrievalOptions {
  uint32_t compare_all_max =
      60;  // images; a database up to this size has no vocabulary and ranks nothing
  uint32_t retrain_factor = 4;  // >= 2; trained again when the database has grown so many times
  uint32_t candidate_count_min = 24;  // >= 1
  double candidate_share = 0.01;      // (0, 1]; of the database; R10
  uint32_t training_count_max =
      500'000;  // descriptors sampled for training; more rank better, and take longer
};

class Retrieval final {
 public:
  explicit Retrieval(RetrievalOptions options) : options_(std::move(options)) {}

  // Best first; without a vocabulary all images that have features, newest first, with a score of
  // 0. Thread-safe.
  Result<std::vector<RankedImage>> Candidates(const Snapshot& snapshot, const Features& features);
  // Distinct words of a photo in the active vocabulary; empty without one. Thread-safe.
  Result<std::vector<WordId>> Words(const Snapshot& snapshot, const Features& features);
  // Best first among all images, for a query that gives its own words.
  Result<std::vector<RankedImage>> RankWords(const Snapshot& snapshot,
                                             std::span<const WordId> words, uint32_t count_max);

  // Depends on what was submitted only, so the same photos train the same vocabularies.
  bool IsTrainingDue(const DatabaseState& state) const;
  // Trains the next generation beside the active one and switches to it in one transaction. For the
  // writer.
  Status Train(Database* database, ThreadPool* pool);
  // Switches to a given tree likewise; it is then never trained again by itself.
  Status Import(Database* database, const VocabularyTree& tree, ThreadPool* pool);

  Result<std::shared_ptr<const VocabularyTree>> ActiveTree(const Snapshot& snapshot);

 private:
  Status Switch(Database* database, const Snapshot& snapshot, const VocabularyTree& tree,
                bool imported, ThreadPool* pool);

  const RetrievalOptions options_;
  std::mutex mutex_;
  uint32_t generation_ = 0;  // of tree_
  std::shared_ptr<const VocabularyTree> tree_;
};

}  // namespace veduta
