// SPDX-License-Identifier: Apache-2.0
// Goal: eq 5 as written, exactly 1 for a stored image, and sound answers at its edges.
// Method: a plain evaluation of eq 5 image by image over random collections; hand-made cases
//   for the edges.
#include "index/scoring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "storage/base/content_hash.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

using Words = std::vector<WordId>;  // distinct, ascending

// ids[i] is the id of collection[i], ascending.
std::vector<std::vector<ImageId>> PostingsOf(const Words& query,
                                             const std::vector<Words>& collection,
                                             const std::vector<uint32_t>& ids) {
  std::vector<std::vector<ImageId>> postings;
  for (const WordId word : query) {
    postings.emplace_back();
    for (size_t i = 0; i < collection.size(); ++i) {
      if (std::binary_search(collection[i].begin(), collection[i].end(), word))
        postings.back().emplace_back(ids[i]);
    }
  }
  return postings;
}

std::vector<uint32_t> Ids(size_t n) {
  std::vector<uint32_t> ids(n);
  for (size_t i = 0; i < n; ++i) ids[i] = static_cast<uint32_t>(i + 1);
  return ids;
}

std::vector<RankedImage> RankAll(const Words& query, const std::vector<Words>& collection) {
  return Rank(PostingsOf(query, collection, Ids(collection.size())),
              static_cast<uint32_t>(collection.size()), {})
      .value();
}

double PlainScore(const Words& query, const std::vector<Words>& collection, const Words& image) {
  double common = 0, self = 0;
  for (const WordId word : query) {
    double n = 0;
    for (const Words& words : collection) n += std::count(words.begin(), words.end(), word);
    const double weight = std::log(static_cast<double>(collection.size()) / std::max(n, 1.0));
    self += weight;
    if (std::count(image.begin(), image.end(), word) > 0) common += weight;
  }
  return common / self;
}

Words RandomWords(SeededRandom& random, uint32_t word_count) {
  Words words;
  for (WordId word = 0; word < word_count; ++word) {
    if (random.Unit() < 0.9 / (1 + word % 17)) words.push_back(word);  // some words are everywhere
  }
  return words;
}

TEST(Scoring, IsEquation5) {
  SeededRandom random(1);
  for (const uint32_t image_count : {2u, 7u, 60u}) {
    std::vector<Words> collection;
    for (uint32_t i = 0; i < image_count; ++i) collection.push_back(RandomWords(random, 300));
    for (int round = 0; round < 10; ++round) {
      const Words query = RandomWords(random, 330);  // 30 words that no image has
      const std::vector<RankedImage> ranked = RankAll(query, collection);
      std::vector<RankedImage> plain;
      for (uint32_t i = 0; i < image_count; ++i) {
        plain.push_back({ImageId(i + 1), PlainScore(query, collection, collection[i])});
      }
      std::stable_sort(plain.begin(), plain.end(),
                       [](const auto& a, const auto& b) { return a.score > b.score; });
      ASSERT_EQ(ranked.size(), plain.size());
      for (size_t i = 0; i < plain.size(); ++i) {
        EXPECT_NEAR(ranked[i].score, plain[i].score, 1e-8);
        EXPECT_EQ(ranked[i].image, plain[i].image);
      }
    }
  }
}

TEST(Scoring, StoredImageScoresExactlyOne) {
  SeededRandom random(2);
  std::vector<Words> collection;
  for (int i = 0; i < 50; ++i) collection.push_back(RandomWords(random, 1000));
  for (uint32_t i = 0; i < collection.size(); ++i) {
    const std::vector<RankedImage> ranked = RankAll(collection[i], collection);
    EXPECT_EQ(ranked.front(), (RankedImage{ImageId(i + 1), 1.0}));
    EXPECT_LT(ranked[1].score, 1.0);
  }
}

TEST(Scoring, ByHand) {
  // N = 4; word 1 in all, word 2 in two, word 3 in one, word 4 in none.
  const std::vector<Words> collection{{1, 2}, {1, 2, 3}, {1}, {1}};
  const std::vector<RankedImage> ranked = RankAll({1, 2, 3, 4}, collection);
  ASSERT_EQ(ranked.size(), 2u);  // images 3 and 4 share only what says nothing
  const double self = std::log(2.0) + 2 * std::log(4.0);
  EXPECT_EQ(ranked[0].image, ImageId(2));
  EXPECT_NEAR(ranked[0].score, (std::log(2.0) + std::log(4.0)) / self, 1e-9);
  EXPECT_EQ(ranked[1].image, ImageId(1));
  EXPECT_NEAR(ranked[1].score, std::log(2.0) / self, 1e-9);
}

TEST(Scoring, WithoutWeightsEveryWordCountsTheSame) {
  EXPECT_EQ(RankAll({3, 5}, {{3, 5}}), (std::vector<RankedImage>{{ImageId(1), 1.0}}));
  // One image stored and a word it lacks: log(1 / max(0, 1)) is zero too.
  EXPECT_EQ(RankAll({3, 5, 9, 11}, {{3, 5, 7}}), (std::vector<RankedImage>{{ImageId(1), 0.5}}));
  EXPECT_EQ(RankAll({3}, {{3}, {3}}),
            (std::vector<RankedImage>{{ImageId(1), 1.0}, {ImageId(2), 1.0}}));
}

TEST(Scoring, NothingInCommonIsAnEmptyRanking) {
  EXPECT_TRUE(RankAll({}, {{1}, {2}}).empty());
  EXPECT_TRUE(RankAll({9}, {{1}, {2}}).empty());
  EXPECT_TRUE(RankAll({9}, {}).empty());
  EXPECT_TRUE(Rank({}, 0, {}).value().empty());
}

TEST(Scoring, KeepsTheBestAboveTheLeast) {
  const std::vector<Words> collection{{1}, {1, 2}, {1, 2, 3}, {1, 2}, {9}};
  const auto postings = PostingsOf({1, 2, 3}, collection, Ids(5));
  const auto ids = [&](const RankOptions& options) {
    std::vector<uint32_t> found;
    const std::vector<RankedImage> ranking = Rank(postings, 5, options).value();
    for (const RankedImage& ranked : ranking) found.push_back(ranked.image.value);
    return found;
  };
  EXPECT_EQ(ids({}), (std::vector<uint32_t>{3, 2, 4, 1}));  // 2 and 4 are equal
  EXPECT_EQ(ids({.count_max = 2}), (std::vector<uint32_t>{3, 2}));
  EXPECT_EQ(ids({.count_max = 0}), (std::vector<uint32_t>{}));
  const double second = Rank(postings, 5, {}).value()[1].score;
  EXPECT_EQ(ids({.score_min = second}), (std::vector<uint32_t>{3, 2, 4}));
  EXPECT_EQ(ids({.score_min = std::nextafter(second, 1.0)}), (std::vector<uint32_t>{3}));
  EXPECT_EQ(ids({.score_min = 1.0}), (std::vector<uint32_t>{3}));
}

TEST(Scoring, LargeIdsGiveTheSameScores) {
  SeededRandom random(3);
  std::vector<Words> collection;
  std::vector<uint32_t> ids;
  for (uint32_t i = 0; i < 40; ++i) {
    collection.push_back(RandomWords(random, 200));
    ids.push_back(i + 1 == 40 ? std::numeric_limits<uint32_t>::max() : 3 + 50'000'000 * i);
  }
  const Words query = RandomWords(random, 200);
  const std::vector<RankedImage> dense = RankAll(query, collection);
  const std::vector<RankedImage> sparse = Rank(PostingsOf(query, collection, ids), 40, {}).value();
  ASSERT_EQ(sparse.size(), dense.size());
  for (size_t i = 0; i < dense.size(); ++i) {
    EXPECT_EQ(sparse[i].image.value, ids[dense[i].image.value - 1]);
    EXPECT_EQ(sparse[i].score, dense[i].score);
  }
}

TEST(Scoring, RefusesWrongInput) {
  using Postings = std::vector<std::vector<ImageId>>;
  const auto code = [](const Postings& postings, uint32_t image_count,
                       const RankOptions& options = {}) {
    return Rank(postings, image_count, options).status().code();
  };
  const ImageId one(1), two(2), none;
  EXPECT_EQ(code({{one, two}}, 2), StatusCode::kOk);
  EXPECT_EQ(code({{one, two}}, 1), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{one}}, 0), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{two, one}}, 2), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{one, one}}, 2), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{none}}, 2), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({{one}}, 2, {.score_min = 1.1}), StatusCode::kInvalidArgument);
}

TEST(RankOptions, EveryBoundIsNoticed) {
  ExpectBounds<RankOptions, double>(&RankOptions::score_min, "score_min", {-0.1, 1.1, std::nan("")},
                                    {0, 1});
  ExpectBounds<RankOptions, uint32_t>(&RankOptions::count_max, "count_max", {}, {0, UINT32_MAX});
}

}  // namespace
}  // namespace veduta
