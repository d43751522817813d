// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which stored images may show what a photo shows (R9, R10), and the vocabulary that this rests on:
// none while the database is young and compares everything, then one trained from its own photos
// and trained again as it outgrows it.

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "engine/camera/decoder.h"
#include "engine/door/submission.h"
#include "index/scoring.h"
#include "index/vocabulary_trainer.h"
#include "index/vocabulary_tree.h"
#include "storage/base/content_hash.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"
#include "storage/written_ahead.h"

namespace veduta {

// Where not said otherwise, the numbers were chosen by hand.
struct RetrievalOptions {
  uint32_t compare_all_max = 60;      // >= 1; images up to which there is no vocabulary
  uint32_t retrain_factor = 4;        // >= 2; trained again when the city has grown so many times
  uint32_t candidate_count_min = 24;  // >= 1; images that a photo is matched with, at least
  double candidate_share = 0.01;      // (0, 1]; of all images, where that is more; R10
  // >= candidate_count_min; bounds what a photo costs in a large city. Of the true neighbours among
  // 2,058 photos 88.5 % are among the first 50, and 91.7 % among the first 100: docs/benchmarks.md.
  uint32_t candidate_count_max = 50;
  uint32_t training_count_max = 2'000'000;  // >= 1; descriptors sampled for training; R8
  // >= 1; words of images that are gathered in memory, at 8 bytes each, before they are added to
  // the posting lists of a new vocabulary. Not measured.
  size_t gathered_words_max = 16'000'000;

  Status Check() const;  // the first violated bound, named with its value
};

class Retrieval final {
 public:
  // The decoder, for photos whose features are damaged, must outlive it.
  explicit Retrieval(RetrievalOptions options,
                     std::shared_ptr<std::mutex> preparing = std::make_shared<std::mutex>(),
                     const PhotoDecoder& decoder = DecoderInProcess())
      : options_(std::move(options)), preparing_(std::move(preparing)), decoder_(decoder) {}

  // Best first; without a vocabulary all images that have features, newest first, with a score of
  // 0. Thread-safe.
  Result<std::vector<RankedImage>> Candidates(const Snapshot& snapshot, const Features& features);
  // Distinct words of a photo in the active vocabulary; empty without one. Thread-safe.
  Result<std::vector<WordId>> Words(const Snapshot& snapshot, const Features& features);
  // Best first among all images, for a query that gives its own words.
  Result<std::vector<RankedImage>> RankWords(const Snapshot& snapshot,
                                             std::span<const WordId> words, uint32_t count_max);

  // Depends on what was submitted only, so the same photos train the same vocabularies.
  // False while a vocabulary is being prepared.
  bool IsTrainingDue(const DatabaseState& state) const;

  // A vocabulary that is written, with the words and postings of the images of one snapshot, and
  // not active yet.
  struct Prepared {
    uint32_t generation = 0;
    VocabularyInfo info;
    std::shared_ptr<const VocabularyTree> tree;
    bool imported = false;
    std::map<ImageId, ContentHash> photos;  // of the images that have words
    std::unique_lock<std::mutex> alone;     // no other vocabulary is prepared meanwhile
    WrittenAhead written_ahead;             // gives it up, unless it became active
  };
  // Trains a tree from the descriptors of all images and writes it ahead, for Activate. Wants no
  // turn of the writer. Waits for another one's that is being prepared. Damaged features are
  // derived from the photo; kCorruption names an image where that fails, too. kInvalidArgument for
  // a shape outside its bounds; kCancelled, after some images or a level of the tree, where it is
  // stopped: then nothing is written ahead any more.
  Result<Prepared> Train(Database* database, ThreadPool* pool,
                         const VocabularyRequest& request = {}, const std::stop_token& stop = {});
  // The same where training is due; none where it is not, or not any more.
  Result<std::optional<Prepared>> TrainIfDue(Database* database, ThreadPool* pool);
  // The same with a given tree; it is then never trained again by itself.
  Result<Prepared> Import(Database* database, VocabularyTree tree, ThreadPool* pool,
                          const std::stop_token& stop = {});
  // Gives words to the images that came meanwhile and switches to the vocabulary, in one
  // transaction. For who has the writer's turn.
  Status Activate(Database* database, Prepared prepared);

  Result<std::shared_ptr<const VocabularyTree>> ActiveTree(const Snapshot& snapshot);

 private:
  Result<Prepared> TrainAlone(Database* database, ThreadPool* pool,
                              const VocabularyRequest& request, std::unique_lock<std::mutex> alone,
                              const std::stop_token& stop);
  Result<Prepared> WriteAhead(Database* database, const Snapshot& snapshot, VocabularyTree tree,
                              bool imported, ThreadPool* pool, std::unique_lock<std::mutex> alone,
                              const std::stop_token& stop);

  // IsTrainingDue, whoever may be preparing one.
  bool HasOutgrown(const DatabaseState& state) const;

  const RetrievalOptions options_;
  // Held from the first thing written ahead to the switch. Shared by all that stand for one
  // database, one after another.
  const std::shared_ptr<std::mutex> preparing_;
  const PhotoDecoder& decoder_;
  std::mutex mutex_;
  uint32_t generation_ = 0;  // of tree_
  std::shared_ptr<const VocabularyTree> tree_;
};

}  // namespace veduta
