// SPDX-License-Identifier: Apache-2.0
// Goal: posting lists are the ascending union of all that was added, whenever memory is flushed
//   and files are merged, in whatever order images come, and however operands are grouped.
// Method: a plain map of sets beside the database; the operator alone against every split of
//   its operands.
#include "storage/postings_merge.h"
#include "storage/records/record_parts.h"

#include <gtest/gtest.h>
#include <rocksdb/merge_operator.h>

#include <deque>
#include <set>

#include "samples.h"

namespace veduta {
namespace {

using Model = std::map<WordId, std::set<uint32_t>>;

void ExpectEqual(const Snapshot& snapshot, uint32_t generation, const Model& model) {
  std::vector<WordId> words;
  for (WordId word = 0; word < 60; ++word) words.push_back(word);  // some were never used
  const auto postings = snapshot.GetPostings(generation, words);
  ASSERT_OK(postings);
  for (size_t i = 0; i < words.size(); ++i) {
    std::vector<ImageId> expected;
    if (const auto found = model.find(words[i]); found != model.end()) {
      for (const uint32_t image : found->second) expected.emplace_back(image);
    }
    EXPECT_EQ((*postings)[i], expected) << "word " << words[i];
  }
  Model scanned;
  ASSERT_OK(snapshot.ScanPostings(generation, [&](WordId word, std::span<const ImageId> images) {
    for (const ImageId image : images) scanned[word].insert(image.value);
    return true;
  }));
  EXPECT_EQ(scanned, model);
}

TEST(Postings, UnionAcrossFlushesCompactionsAndReopening) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  Model model;
  for (uint32_t round = 0; round < 40; ++round) {
    // Not ascending, and some images twice: a re-run must not change anything.
    const uint32_t image = 1 + (round * 7) % 30;
    SeededRandom random(image);
    std::vector<WordId> words;
    for (WordId word = 0; word < 50; ++word) {
      if (random.Below(3) == 0) words.push_back(word);
    }
    auto transaction = database->BeginTransaction();
    transaction->AddPostings(4, words, ImageId(image));
    transaction->AddPostings(5, words, ImageId(1));  // the neighbouring generation must not leak in
    ASSERT_OK(transaction->Commit());
    for (const WordId word : words) model[word].insert(image);
    if (round % 8 == 3) {
      ASSERT_OK(database->Compact());
    }
    if (round % 10 == 5) {
      database.reset();
      database = MustOpen(folder / "db", {});
    }
    if (round % 5 == 0) ExpectEqual(*database->GetSnapshot(), 4, model);
  }
  ExpectEqual(*database->GetSnapshot(), 4, model);
  ASSERT_OK(database->Compact());
  ExpectEqual(*database->GetSnapshot(), 4, model);
}

TEST(Postings, WrittenAheadThenAddedTo) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(database->WritePostingsAhead(1, 9, std::vector<ImageId>{ImageId(2), ImageId(5)}));
  auto transaction = database->BeginTransaction();
  transaction->AddPostings(1, std::vector<WordId>{9}, ImageId(3));
  transaction->AddPostings(1, std::vector<WordId>{9},
                           ImageId(8));  // two operands of one key in one transaction
  ASSERT_OK(transaction->Commit());
  ExpectEqual(*database->GetSnapshot(), 1, {{9, {2, 3, 5, 8}}});
}

TEST(Postings, WrittenAheadInPieces) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(database->WritePostingsAhead(1, 9, std::vector<ImageId>{ImageId(2), ImageId(5)}));
  ASSERT_OK(database->WritePostingsAhead(1, 9, std::vector<ImageId>{ImageId(6), ImageId(7)}));
  ASSERT_OK(database->WritePostingsAhead(1, 8, std::vector<ImageId>{ImageId(7)}));
  const Model expected = {{8, {7}}, {9, {2, 5, 6, 7}}};
  ExpectEqual(*database->GetSnapshot(), 1, expected);
  ASSERT_OK(database->Compact());
  ExpectEqual(*database->GetSnapshot(), 1, expected);
  // A list that cannot be stored is refused, and changes nothing.
  EXPECT_EQ(database->WritePostingsAhead(1, 9, std::vector<ImageId>{ImageId(0)}).code(),
            StatusCode::kInvalidArgument);
  ExpectEqual(*database->GetSnapshot(), 1, expected);
}

TEST(Postings, ARemovedImageStaysOutHoweverFilesAreMerged) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  Model model;
  SeededRandom random(3);
  std::vector<WordId> words;
  for (WordId word = 0; word < 50; ++word) words.push_back(word);
  for (uint32_t image = 1; image <= 40; ++image) {
    auto transaction = database->BeginTransaction();
    transaction->AddPostings(4, words, ImageId(image));
    for (const WordId word : words) model[word].insert(image);
    if (image % 3 == 0) {
      const uint32_t gone = 1 + random.Below(image);  // some twice: the second time changes nothing
      transaction->RemoveWords(4, words, ImageId(gone));
      for (const WordId word : words) model[word].erase(gone);
    }
    ASSERT_OK(transaction->Commit());
    if (image % 7 == 0) {
      ASSERT_OK(database->Compact());
    }
    if (image % 5 == 0) ExpectEqual(*database->GetSnapshot(), 4, model);
  }
  ASSERT_OK(database->Compact());
  ExpectEqual(*database->GetSnapshot(), 4, model);
  auto transaction = database->BeginTransaction();
  for (uint32_t image = 1; image <= 40; ++image) transaction->RemoveWords(4, words, ImageId(image));
  transaction->RemoveWords(4, words, {});
  EXPECT_EQ(transaction->Commit().code(), StatusCode::kInvalidArgument);
  transaction = database->BeginTransaction();
  for (uint32_t image = 1; image <= 40; ++image) transaction->RemoveWords(4, words, ImageId(image));
  ASSERT_OK(transaction->Commit());
  ExpectEqual(*database->GetSnapshot(), 4, {});
}

TEST(Postings, WordsMustAscend) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  EXPECT_EQ(database->GetSnapshot()->GetPostings(1, std::vector<WordId>{4, 3}).status().code(),
            StatusCode::kInvalidArgument);
}

std::string Operand(const std::vector<uint32_t>& ids) {
  std::string bytes;
  for (const uint32_t id : ids) bytes += EncodeU32(id);
  return bytes;
}

TEST(Postings, OperatorIsAssociative) {
  const auto merge = MakePostingsMerge();
  const std::vector<std::string> operands = {
      Operand({5}),     Operand({1, 9}), Operand({}),        Operand({0, 9}), Operand({9, 10, 300}),
      Operand({0, 77}), Operand({2}),    Operand({4, 0, 1}), Operand({5})};
  const std::string expected = Operand({2, 4, 5, 10, 300});
  for (size_t cut = 0; cut <= operands.size(); ++cut) {
    // The first `cut` operands are a stored value, the others are merged among themselves first.
    const std::deque<rocksdb::Slice> head(operands.begin(), operands.begin() + cut),
        tail(operands.begin() + cut, operands.end());
    std::string stored, partial;
    ASSERT_TRUE(merge->PartialMergeMulti("key", head, &stored, nullptr));
    ASSERT_TRUE(merge->PartialMergeMulti("key", tail, &partial, nullptr));
    const rocksdb::Slice existing(stored), slice_key("key");
    std::string result;
    rocksdb::Slice existing_operand;
    rocksdb::MergeOperator::MergeOperationOutput output(result, existing_operand);
    const std::vector<rocksdb::Slice> others = {rocksdb::Slice(partial)};
    const rocksdb::MergeOperator::MergeOperationInput input(slice_key, &existing, others, nullptr);
    ASSERT_TRUE(merge->FullMergeV2(input, &output));
    EXPECT_EQ(result, expected) << cut;
  }
  std::string result;
  EXPECT_FALSE(merge->PartialMergeMulti("key", {rocksdb::Slice("abc")}, &result, nullptr))
      << "three bytes are no id";
}

}  // namespace
}  // namespace veduta
