// SPDX-License-Identifier: Apache-2.0
#include "engine/retrieval/retrieval.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/journal/journal.h"
#include "engine/photo/derived_features.h"
#include "index/descriptor_sample.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr size_t kBatchImages = 32;  // chosen by hand; not measured
// Of VocabularyRequest::sample; chosen by hand, not measured.
constexpr uint32_t kSampleMin = 1000, kSampleMax = 16u << 20;

// Writes the posting lists of a vocabulary ahead, in bounded memory: what is gathered is added to
// the lists whenever it has become too much.
class PostingsWriter {
 public:
  PostingsWriter(Database* database, uint32_t generation, size_t gathered_max)
      : database_(database), generation_(generation), gathered_max_(gathered_max) {}

  Status Add(ImageId image, std::span<const WordId> words) {
    for (const WordId word : words) gathered_.push_back(uint64_t{word} << 32 | image.value);
    return gathered_.size() < gathered_max_ ? Status::Ok() : Flush();
  }

  Status Flush() {
    std::sort(gathered_.begin(), gathered_.end());
    std::vector<ImageId> images;
    for (size_t i = 0; i < gathered_.size(); ++i) {
      images.emplace_back(static_cast<uint32_t>(gathered_[i]));
      const auto word = static_cast<WordId>(gathered_[i] >> 32);
      if (i + 1 < gathered_.size() && gathered_[i + 1] >> 32 == word) continue;
      VEDUTA_RETURN_IF_ERROR(database_->WritePostingsAhead(generation_, word, images));
      images.clear();
    }
    gathered_.clear();
    return Status::Ok();
  }

 private:
  Database* const database_;
  const uint32_t generation_;
  const size_t gathered_max_;
  std::vector<uint64_t> gathered_;  // word, and image in the low half
};

Status Stopped() {
  return Status::Cancelled("stopped: no new vocabulary was made");
}

// Images that have features stored, ascending.
Result<std::vector<ImageRecord>> ListRetrievable(const Snapshot& snapshot) {
  std::vector<ImageRecord> images;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanImages([&](const ImageRecord& image) {
    if (image.verdict != Verdict::kRejected) images.push_back(image);
    return true;
  }));
  return images;
}

// Derived from the photo where they are damaged. A failure names the image.
Result<Features> FeaturesOf(const Snapshot& snapshot, const ImageRecord& image,
                            const PhotoDecoder& decoder) {
  Result<Features> features = ReadOrDeriveFeatures(snapshot, image, decoder);
  if (features.status().code() != StatusCode::kCorruption) return features;
  return Status::Corruption(
      "the features of image " + std::to_string(image.id.value) +
      " cannot be read, and cannot be extracted from its photo: " + features.status().message());
}

// The distinct words of a stored image.
Result<std::vector<WordId>> WordsOf(const Snapshot& snapshot, const ImageRecord& image,
                                    const VocabularyTree& tree, const PhotoDecoder& decoder) {
  VEDUTA_ASSIGN_OR_RETURN(const Features features, FeaturesOf(snapshot, image, decoder));
  return DistinctWords(tree.QuantizeAll(features.descriptors));
}

// Images that were removed while the vocabulary was prepared have words in it that nobody may find.
Status RemoveGone(const Snapshot& snapshot, std::span<const ImageRecord> images,
                  Retrieval::Prepared* prepared, Transaction* transaction) {
  std::set<ImageId> there;
  for (const ImageRecord& image : images) there.insert(image.id);
  for (const auto& [id, photo] : prepared->photos) {
    if (there.contains(id)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words,
                            snapshot.GetWords(prepared->generation, id));
    transaction->RemoveWords(prepared->generation, words, id);
  }
  std::erase_if(prepared->photos, [&](const auto& entry) { return !there.contains(entry.first); });
  return Status::Ok();
}

// What an earlier attempt wrote under this number, and did not activate, must not stay among it. A
// photo that is committed at this moment makes the deletion begin again.
Status DeleteLeftovers(Database* database, uint32_t generation) {
  for (;;) {
    const std::unique_ptr<Transaction> transaction = database->BeginTransaction();
    transaction->DeleteVocabulary(generation);
    const Status deleted = transaction->Commit();
    if (deleted.code() != StatusCode::kBusy) return deleted;
  }
}

}  // namespace

Status VocabularyRequest::Check() const {
  return OptionBounds()
      .Between("branch", branch, kVocabularyBranchMin, kVocabularyBranchMax)
      .Between("levels", levels, 1, kVocabularyDepthMax)
      .Between("sample", sample == 0 ? kSampleMin : sample, kSampleMin, kSampleMax)
      .status();
}

Status RetrievalOptions::Check() const {
  return OptionBounds()
      .AtLeast("compare_all_max", compare_all_max, 1)
      .AtLeast("retrain_factor", retrain_factor, 2)
      .AtLeast("candidate_count_min", candidate_count_min, 1)
      .AboveUpTo("candidate_share", candidate_share, 0, 1)
      .AtLeast("candidate_count_max", candidate_count_max, candidate_count_min)
      .AtLeast("training_count_max", training_count_max, 1)
      .AtLeast("gathered_words_max", gathered_words_max, 1)
      .status();
}

Result<std::shared_ptr<const VocabularyTree>> Retrieval::ActiveTree(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  if (state.vocabulary_generation == 0) return std::shared_ptr<const VocabularyTree>();
  const std::lock_guard lock(mutex_);
  if (generation_ != state.vocabulary_generation) {
    VEDUTA_ASSIGN_OR_RETURN(const StoredBytes stored,
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
                   std::clamp(static_cast<uint32_t>(share), options_.candidate_count_min,
                              options_.candidate_count_max));
}

bool Retrieval::HasOutgrown(const DatabaseState& state) const {
  if (state.vocabulary_imported) return false;
  if (state.vocabulary_generation == 0)
    return state.retrievable_image_count >= options_.compare_all_max;
  return state.retrievable_image_count >=
         uint64_t{options_.retrain_factor} * state.images_at_vocabulary;
}

bool Retrieval::IsTrainingDue(const DatabaseState& state) const {
  const std::unique_lock nobody_prepares(*preparing_, std::try_to_lock);
  return nobody_prepares.owns_lock() && HasOutgrown(state);
}

Result<Retrieval::Prepared> Retrieval::Train(Database* database, ThreadPool* pool,
                                             const VocabularyRequest& request,
                                             const std::stop_token& stop) {
  VEDUTA_RETURN_IF_ERROR(OptionBounds().Part("VocabularyRequest", request.Check()).status());
  return TrainAlone(database, pool, request, std::unique_lock(*preparing_), stop);
}

Result<std::optional<Retrieval::Prepared>> Retrieval::TrainIfDue(Database* database,
                                                                 ThreadPool* pool) {
  std::unique_lock alone(*preparing_);
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, database->GetSnapshot()->GetState());
  if (!HasOutgrown(state)) return std::optional<Prepared>();
  VEDUTA_ASSIGN_OR_RETURN(Prepared prepared, TrainAlone(database, pool, {}, std::move(alone), {}));
  return std::optional(std::move(prepared));
}

Result<Retrieval::Prepared> Retrieval::TrainAlone(Database* database, ThreadPool* pool,
                                                  const VocabularyRequest& request,
                                                  std::unique_lock<std::mutex> alone,
                                                  const std::stop_token& stop) {
  const std::shared_ptr<const Snapshot> snapshot = database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageRecord> images, ListRetrievable(*snapshot));
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot->GetState());
  // Training falls due by this count: by a wrong one it would fall due again and again.
  if (images.size() != state.retrievable_image_count) {
    return Status::Corruption(
        "family meta, key 'state': it counts " + std::to_string(state.retrievable_image_count) +
        " images with features, and there are " + std::to_string(images.size()));
  }
  DescriptorSample sample(request.sample == 0 ? options_.training_count_max : request.sample);
  for (const ImageRecord& image : images) {
    if (stop.stop_requested()) return Stopped();
    VEDUTA_ASSIGN_OR_RETURN(const Features features, FeaturesOf(*snapshot, image, decoder_));
    sample.Add(image.photo.Seed(), features.descriptors);
  }
  std::vector<uint8_t> descriptors = sample.Take();
  VocabularyTrainerOptions options = OptionsForSample(descriptors.size() / kDescriptorSize);
  options.branch = request.branch;
  options.depth_max = request.levels;
  VEDUTA_ASSIGN_OR_RETURN(TrainedVocabulary trained,
                          TrainVocabulary(descriptors, options, *pool, stop));
  descriptors = {};  // the words of all images want memory next
  return WriteAhead(database, *snapshot, std::move(trained.tree), false, pool, std::move(alone),
                    stop);
}

Result<Retrieval::Prepared> Retrieval::Import(Database* database, VocabularyTree tree,
                                              ThreadPool* pool, const std::stop_token& stop) {
  std::unique_lock alone(*preparing_);
  const std::shared_ptr<const Snapshot> snapshot = database->GetSnapshot();
  return WriteAhead(database, *snapshot, std::move(tree), true, pool, std::move(alone), stop);
}

Result<Retrieval::Prepared> Retrieval::WriteAhead(Database* database, const Snapshot& snapshot,
                                                  VocabularyTree tree, bool imported,
                                                  ThreadPool* pool,
                                                  std::unique_lock<std::mutex> alone,
                                                  const std::stop_token& stop) {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageRecord> images, ListRetrievable(snapshot));
  Prepared prepared;
  prepared.generation = state.vocabulary_generation + 1;
  prepared.info = tree.info();
  prepared.tree = std::make_shared<const VocabularyTree>(std::move(tree));
  prepared.imported = imported;
  for (const ImageRecord& image : images) prepared.photos[image.id] = image.photo;
  prepared.alone = std::move(alone);
  VEDUTA_RETURN_IF_ERROR(DeleteLeftovers(database, prepared.generation));
  prepared.written_ahead = WrittenAhead::Vocabulary(database, prepared.generation);
  VEDUTA_RETURN_IF_ERROR(
      database->WriteVocabularyAhead(prepared.generation, prepared.tree->Serialize()));

  // In batches, so that memory holds a few images' features and not the whole city's.
  PostingsWriter postings(database, prepared.generation, options_.gathered_words_max);
  for (size_t begin = 0; begin < images.size(); begin += kBatchImages) {
    if (stop.stop_requested()) return Stopped();
    const size_t count = std::min(kBatchImages, images.size() - begin);
    std::vector<Result<std::vector<WordId>>> words(count, std::vector<WordId>());
    pool->ParallelFor(count, [&](size_t i) {
      words[i] = WordsOf(snapshot, images[begin + i], *prepared.tree, decoder_);
    });
    for (size_t i = 0; i < count; ++i) {
      if (!words[i].ok()) return words[i].status();
      const ImageId id = images[begin + i].id;
      VEDUTA_RETURN_IF_ERROR(database->WriteWordsAhead(prepared.generation, id, *words[i]));
      VEDUTA_RETURN_IF_ERROR(postings.Add(id, *words[i]));
    }
  }
  VEDUTA_RETURN_IF_ERROR(postings.Flush());
  return prepared;
}

Status Retrieval::Activate(Database* database, Prepared prepared) {
  const std::unique_ptr<Transaction> transaction = database->BeginTransaction();
  const std::shared_ptr<const Snapshot> snapshot = transaction->base();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, snapshot->GetState());
  if (state.vocabulary_generation + 1 != prepared.generation) {
    return Status::Busy("another vocabulary became active meanwhile: train again");
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageRecord> images, ListRetrievable(*snapshot));
  for (const ImageRecord& image : images) {
    const auto [known, is_new] = prepared.photos.try_emplace(image.id, image.photo);
    if (!is_new && known->second == image.photo) continue;
    VEDUTA_ASSIGN_OR_RETURN(std::vector<WordId> words,
                            WordsOf(*snapshot, image, *prepared.tree, decoder_));
    if (!is_new) {  // a larger copy has taken its place: it has the words of both
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> before,
                              snapshot->GetWords(prepared.generation, image.id));
      words.insert(words.end(), before.begin(), before.end());
      words = DistinctWords(std::move(words));
    }
    transaction->PutWords(prepared.generation, image.id, words);
    transaction->AddPostings(prepared.generation, words, image.id);
  }
  VEDUTA_RETURN_IF_ERROR(RemoveGone(*snapshot, images, &prepared, transaction.get()));
  const uint32_t old_generation = state.vocabulary_generation;
  state.vocabulary_generation = prepared.generation;
  state.images_at_vocabulary = static_cast<uint32_t>(prepared.photos.size());
  state.vocabulary_imported = prepared.imported;
  JournalRecord entry;
  entry.actor = "veduta";
  entry.action = "vocabulary";
  entry.detail = (prepared.imported ? "imported " : "trained ") +
                 std::to_string(prepared.info.leaf_count) + " words for " +
                 std::to_string(prepared.photos.size()) + " images";
  AppendJournal(std::move(entry), &state, transaction.get());
  transaction->PutState(state);
  if (old_generation != 0) transaction->DeleteVocabulary(old_generation);
  return transaction->Commit();
}

}  // namespace veduta
