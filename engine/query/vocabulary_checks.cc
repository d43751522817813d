// SPDX-License-Identifier: Apache-2.0
// The vocabulary's tree, the words of images, and the images of words.
#include "engine/query/checked_city.h"
#include "engine/query/replaced_images.h"
#include "engine/query/stored_records.h"
#include "index/vocabulary_tree.h"
#include "storage/records/key_bytes.h"

namespace veduta {
namespace {

class VocabularyChecker final {
 public:
  VocabularyChecker(const CheckedCity& city, Violations* violations)
      : city_(city), violations_(*violations), active_(city.state.vocabulary_generation) {}

  Status Run() {
    // A damaged entry of the journal is told by CheckJournal.
    if (Result<std::set<ImageId>> replaced = ReplacedImages(city_.snapshot); replaced.ok())
      replaced_ = std::move(*replaced);
    VEDUTA_RETURN_IF_ERROR(CheckTrees());
    violations_.Expect(active_ == 0 || tree_.has_value(),
                       "there is no vocabulary that can be read");
    VEDUTA_RETURN_IF_ERROR(
        WalkRecords<WordsEntry>(city_.snapshot, Family::kWords, &violations_,
                                [&](const WordsEntry& entry) { CheckWordsOf(entry); }));
    for (const auto& [id, image] : city_.images) {
      violations_.Expect(active_ == 0 || !city_.HasFeatures(id) || with_words_.contains(id),
                         [&, id = id] { return NameOf(id) + " has no words"; });
    }
    VEDUTA_RETURN_IF_ERROR(
        WalkRecords<PostingsEntry>(city_.snapshot, Family::kPostings, &violations_,
                                   [&](const PostingsEntry& entry) { CheckPostings(entry); }));
    violations_.Expect(lists_ == images_of_.size(), [&] {
      return std::to_string(lists_) + " posting lists for " + std::to_string(images_of_.size()) +
             " words in use";
    });
    return Status::Ok();
  }

 private:
  // Reports what is of a generation that is not active and that no mark names.
  bool IsActive(uint32_t generation, const std::string& what) {
    if (generation == active_) return generation != 0;
    violations_.Expect(city_.vocabularies_ahead.contains(generation), [&] {
      return what + " of vocabulary generation " + std::to_string(generation) +
             " are stored, and nothing names them";
    });
    return false;
  }

  Status CheckTrees() {
    return WalkStored(city_.snapshot, Family::kVocabulary, &violations_,
                      [&](std::string_view key, std::string_view value) {
                        uint32_t generation = 0;
                        const Status id = ParseId(key, &generation);
                        if (!id.ok()) {
                          violations_.Add(PlaceOf(Family::kVocabulary, key) + ": " + id.message());
                          return;
                        }
                        if (IsActive(generation, "the tree")) ReadTree(value);
                      });
  }

  void ReadTree(std::string_view value) {
    Result<VocabularyTree> tree =
        VocabularyTree::Parse({reinterpret_cast<const uint8_t*>(value.data()), value.size()});
    if (tree.ok()) {
      tree_ = std::move(*tree);
    } else {
      violations_.Add(tree.status().message());
    }
  }

  void CheckWordsOf(const WordsEntry& entry) {
    if (!IsActive(entry.generation, "words")) return;
    const std::string name = NameOf(entry.image);
    violations_.Expect(city_.HasFeatures(entry.image), [&] {
      return name + " has words, and there is no such image with features";
    });
    violations_.Expect(!entry.words.empty(), [&] { return name + " has no words"; });
    with_words_.insert(entry.image);
    for (const WordId word : entry.words) images_of_[word].push_back(entry.image);
    if (!tree_ || entry.words.empty()) return;
    violations_.Expect(entry.words.back() < tree_->info().leaf_count,
                       [&] { return name + " has a word that the vocabulary does not have"; });
    if (city_.deep && city_.HasFeatures(entry.image) && !replaced_.contains(entry.image))
      CompareWords(entry);
  }

  // The words again, from the features.
  void CompareWords(const WordsEntry& entry) {
    const Result<Features> features =
        city_.snapshot.GetFeatures(city_.images.at(entry.image).photo);
    if (!features.ok()) return;  // CheckImages has said so
    violations_.Expect(
        DistinctWords(tree_->QuantizeAll(features->descriptors)) == entry.words,
        [&] { return NameOf(entry.image) + ": its words are not those of its features"; });
  }

  void CheckPostings(const PostingsEntry& entry) {
    if (!IsActive(entry.generation, "postings")) return;
    if (entry.images.empty()) return;  // the images that had the word were removed
    ++lists_;
    const auto expected = images_of_.find(entry.word);
    violations_.Expect(expected != images_of_.end() && expected->second == entry.images, [&] {
      return "the postings of word " + std::to_string(entry.word) +
             " are not the images that have it";
    });
  }

  const CheckedCity& city_;
  Violations& violations_;
  const uint32_t active_;
  std::optional<VocabularyTree> tree_;
  std::map<WordId, std::vector<ImageId>> images_of_;  // ascending, as keys are
  std::set<ImageId> with_words_;
  std::set<ImageId> replaced_;  // they may have words of an earlier photo
  uint64_t lists_ = 0;
};

}  // namespace

Status CheckVocabulary(const CheckedCity& city, Violations* violations) {
  return VocabularyChecker(city, violations).Run();
}

}  // namespace veduta
