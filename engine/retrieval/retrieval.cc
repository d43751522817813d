// SPDX-License-Identifier: Apache-2.0
#include "engine/retrieval/retrieval.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>

#include "index/descriptor_sample.h"

namespace veduta {
namespace {

// Images that have features stored, ascending.
Result<std::vector<ImageRecord>> ListRetrievable(const Snapshot& snapshot) {
  std::vector<ImageRecord> images;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanImages([&](const ImageRecord& image) {
    if (image.verdict != Verdict::kRejected) images.push_back(image);
    return true;
  }));
  return images;
}

}  // namespace

Result<std::shared_ptr<const VocabularyTree>> Retrieval::ActiveTree(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  if (state.vocabulary_generation == 0) return std::shared_ptr<const VocabularyTree>();
  const std::lock_guard lock(mutex_);
  if (generation_ != state.vocabulary_generation) {
    VEDUTA_ASSIGN_OR_RETURN(const PinnedBytes stored,
                            snapshot.GetVocabulary(state.vocabulary_generation));
    VEDUTA_ASSIGN_OR_RETURN(VocabularyTree tree, VocabularyTree::Parse(stored.bytes()));
    tree_ = std::make_shared<const VocabularyTree>(std::move(tree));
    generation_ = state.vocabulary_generation;
  }
  return tree_;
}

Result<std::vector<WordId>> Retrieval::Words(const Snapshot& snapshot, const Features& features) {
  VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const VocabularyTree> tree, ActiveTree(snapshot));
  if (tree == nullptr) return std::vector<WordId>();
  return DistinctWords(tree->QuantizeAll(features.descriptors));
}

Result<std::vector<RankedImage>> Retrieval::RankWords(const Snapshot& snapshot,
                                                      std::span<const WordId> words,
                                                      uint32_t count_max) {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  VEDUTA_ASSIGN_OR_RETURN(const auto postings,
                          snapshot.GetPostings(state.vocabulary_generation, words));
  RankOptions options;
  options.count_max = count_max;
  return Rank(postings, state.retrievable_image_count, options);
}

Result<std::vector<RankedImage>> Retrieval::Candidates(const Snapshot& snapshot,
                                                       const Features& features) {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  if (state.vocabulary_generation == 0) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageRecord> images, ListRetrievable(snapshot));
    std::vector<RankedImage> all;
    for (auto it = images.rbegin(); it != images.rend(); ++it) all.push_back({it->id, 0.0});
    return all;
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words, Words(snapshot, features));
  const double share = std::ceil(options_.candidate_share * state.retrievable_image_count);
  return RankWords(snapshot, words,
                   std::max(options_.candidate_count_min, static_cast<uint32_t>(share)));
}

bool Retrieval::IsTrainingDue(const DatabaseState& state) const {
  if (state.vocabulary_imported) return false;
  if (state.vocabulary_generation == 0)
    return state.retrievable_image_count >= options_.compare_all_max;
  return state.retrievable_image_count >=
         uint64_t{options_.retrain_factor} * state.images_at_vocabulary;
}

Status Retrieval::Train(Database* database, ThreadPool* pool) {
  const std::shared_ptr<const Snapshot> snapshot = database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageRecord> images, ListRetrievable(*snapshot));
  DescriptorSample sample(options_.training_count_max);
  for (const ImageRecord& image : images) {
    VEDUTA_ASSIGN_OR_RETURN(const Features features, snapshot->GetFeatures(image.photo));
    sample.Add(image.photo.Seed(), features.descriptors);
  }
  const std::vector<uint8_t> descriptors = sample.Take();
  VEDUTA_ASSIGN_OR_RETURN(
      const TrainedVocabulary trained,
      TrainVocabulary(descriptors, OptionsForSample(descriptors.size() / kDescriptorSize), *pool));
  return Switch(database, *snapshot, trained.tree, false, pool);
}

Status Retrieval::Import(Database* database, const VocabularyTree& tree, ThreadPool* pool) {
  const std::shared_ptr<const Snapshot> snapshot = database->GetSnapshot();
  return Switch(database, *snapshot, tree, true, pool);
}

Status Retrieval::Switch(Database* database, const Snapshot& snapshot, const VocabularyTree& tree,
                         bool imported, ThreadPool* pool) {
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, snapshot.GetState());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageRecord> images, ListRetrievable(snapshot));
  const uint32_t old_generation = state.vocabulary_generation, generation = old_generation + 1;
  VEDUTA_RETURN_IF_ERROR(database->WriteVocabularyAhead(generation, tree.Serialize()));

  // In batches, so that memory holds a few images' features and the postings, not the whole city's
  // features.
  constexpr size_t kBatch = 32;
  std::map<WordId, std::vector<ImageId>> postings;
  for (size_t begin = 0; begin < images.size(); begin += kBatch) {
    const size_t count = std::min(kBatch, images.size() - begin);
    std::vector<Result<std::vector<WordId>>> words(count, std::vector<WordId>());
    pool->ParallelFor(count, [&](size_t i) {
      Result<Features> features = snapshot.GetFeatures(images[begin + i].photo);
      words[i] = features.ok() ? Result(DistinctWords(tree.QuantizeAll(features->descriptors)))
                               : features.status();
    });
    for (size_t i = 0; i < count; ++i) {
      if (!words[i].ok()) return words[i].status();
      const ImageId id = images[begin + i].id;
      VEDUTA_RETURN_IF_ERROR(database->WriteWordsAhead(generation, id, *words[i]));
      for (const WordId word : *words[i]) postings[word].push_back(id);
    }
  }
  for (const auto& [word, list] : postings) {
    VEDUTA_RETURN_IF_ERROR(database->WritePostingsAhead(generation, word, list));
  }

  const std::unique_ptr<Transaction> transaction = database->BeginTransaction();
  state.vocabulary_generation = generation;
  state.images_at_vocabulary = static_cast<uint32_t>(images.size());
  state.vocabulary_imported = imported;
  JournalRecord record;
  record.sequence = state.next_journal++;
  record.time_unix_s = std::time(nullptr);
  record.actor = "veduta";
  record.action = "vocabulary";
  record.detail = (imported ? "imported " : "trained ") + std::to_string(tree.info().leaf_count) +
                  " words for " + std::to_string(images.size()) + " images";
  transaction->AddJournal(record);
  transaction->PutState(state);
  if (old_generation != 0) transaction->DeleteVocabulary(old_generation);
  return transaction->Commit();
}

}  // namespace veduta
