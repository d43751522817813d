// SPDX-License-Identifier: Apache-2.0
// Goal: training gives the same tree on any number of threads, keeps the best of its attempts,
//   respects its options and refuses what cannot be trained on.
// Method: clustered random descriptors; trees compared by their bytes; the distortion
//   recomputed from the stored centres.
#include "index/vocabulary_trainer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/index/synthetic_descriptors.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

TrainedVocabulary Train(const std::vector<uint8_t>& descriptors,
                        const VocabularyTrainerOptions& options, size_t threads = 1) {
  ThreadPool pool(threads);
  Result<TrainedVocabulary> trained = TrainVocabulary(descriptors, options, pool);
  EXPECT_TRUE(trained.ok()) << trained.status().message();
  return std::move(trained).value();
}

TEST(VocabularyTrainer, IsStopped) {
  std::stop_source stop;
  stop.request_stop();
  ThreadPool pool(1);
  const std::vector<uint8_t> descriptors = RandomDescriptors(100, 1);
  EXPECT_EQ(TrainVocabulary(descriptors, {}, pool, stop.get_token()).status().code(),
            StatusCode::kCancelled);
}

TEST(VocabularyTrainer, DoesNotDependOnThreads) {
  const std::vector<uint8_t> descriptors = ClusteredDescriptors(20'000, 300, 40, 1);
  VocabularyTrainerOptions options;
  options.depth_max = 4;
  options.attempts_per_node = 2;
  options.descriptors_per_leaf = 10;
  options.iterations_max = 4;
  for (const uint32_t node_sample_max : {2'000u, 1'000'000u}) {
    options.node_sample_max = node_sample_max;
    const std::vector<uint8_t> expected = Train(descriptors, options, 0).tree.Serialize();
    EXPECT_EQ(Train(descriptors, options, 1).tree.Serialize(), expected);
    EXPECT_EQ(Train(descriptors, options, 4).tree.Serialize(), expected);
  }
  const std::vector<uint8_t> before = Train(descriptors, options).tree.Serialize();
  options.seed = 2;
  EXPECT_NE(Train(descriptors, options).tree.Serialize(), before);
}

TEST(VocabularyTrainer, ReportsItsTree) {
  const std::vector<uint8_t> descriptors = RandomDescriptors(5000, 2);
  VocabularyTrainerOptions options;
  options.branch = 6;
  options.depth_max = 3;
  const VocabularyInfo info = Train(descriptors, options).tree.info();
  EXPECT_EQ(info.branch, 6u);
  EXPECT_EQ(info.depth, 3u);
  EXPECT_EQ(info.training_size, 5000u);
  EXPECT_GT(info.leaf_count, 180u);
  EXPECT_LE(info.leaf_count, 216u);
}

TEST(VocabularyTrainer, DistortionIsTheDistanceToTheLeaf) {
  const std::vector<uint8_t> descriptors = ClusteredDescriptors(2000, 60, 30, 3);
  VocabularyTrainerOptions options;
  options.depth_max = 1;
  options.branch = 16;
  const TrainedVocabulary trained = Train(descriptors, options);
  const std::vector<uint8_t> bytes = trained.tree.Serialize();
  const size_t count = trained.tree.info().leaf_count;
  const uint8_t* centers = bytes.data() + bytes.size() - 32 - count * kCenterSize;
  const std::vector<WordId> words = trained.tree.QuantizeAll(descriptors);
  double sum = 0;
  for (size_t i = 0; i < words.size(); ++i) {
    for (size_t j = 0; j < kCenterSize; ++j) {
      const double d = static_cast<double>(centers[words[i] * kCenterSize + j]) -
                       descriptors[i * kCenterSize + j];
      sum += d * d;
    }
  }
  EXPECT_NEAR(trained.distortion_mean, sum / static_cast<double>(words.size()), 1e-6);
}

TEST(VocabularyTrainer, MoreAttemptsAndLevelsLowerTheDistortion) {
  const std::vector<uint8_t> descriptors = ClusteredDescriptors(4000, 80, 20, 4);
  VocabularyTrainerOptions options;
  options.depth_max = 1;
  options.branch = 20;
  options.attempts_per_node = 1;
  const double one = Train(descriptors, options).distortion_mean;
  options.attempts_per_node = 8;  // the first of them is the one above
  const double best = Train(descriptors, options).distortion_mean;
  EXPECT_LT(best, one);
  options.depth_max = 2;
  EXPECT_LT(Train(descriptors, options).distortion_mean, 0.8 * best);
}

TEST(VocabularyTrainer, ClustersFarApartGetTheirOwnWords) {
  const size_t cluster_count = 40, each = 30;
  const std::vector<uint8_t> clusters = RandomDescriptors(cluster_count, 5);
  SeededRandom random(6);
  std::vector<uint8_t> descriptors;
  for (size_t i = 0; i < cluster_count * each; ++i) {
    Append(&descriptors, SeenAgain(&clusters[i % cluster_count * kCenterSize], 2, random));
  }
  VocabularyTrainerOptions options;
  options.branch = 8;
  options.descriptors_per_leaf = each / 2;
  const VocabularyTree tree = Train(descriptors, options).tree;
  const std::vector<WordId> words = tree.QuantizeAll(descriptors);
  std::vector<std::vector<WordId>> words_of(cluster_count);
  for (size_t i = 0; i < words.size(); ++i) words_of[i % cluster_count].push_back(words[i]);
  // A cluster may have several words, but no two clusters share one.
  std::vector<WordId> all;
  for (const std::vector<WordId>& of : words_of) {
    const std::vector<WordId> distinct = DistinctWords(of);
    all.insert(all.end(), distinct.begin(), distinct.end());
  }
  EXPECT_EQ(DistinctWords(all).size(), all.size());
}

TEST(VocabularyTrainer, DescriptorsPerLeafBoundsTheLeaves) {
  const std::vector<uint8_t> descriptors = RandomDescriptors(3000, 7);
  VocabularyTrainerOptions options;
  options.descriptors_per_leaf = 1;  // down to single descriptors
  EXPECT_EQ(Train(descriptors, options).tree.info().leaf_count, 3000u);
  options.descriptors_per_leaf = 3;
  const TrainedVocabulary third = Train(descriptors, options);
  EXPECT_GT(third.tree.info().leaf_count, 500u);
  EXPECT_LE(third.tree.info().leaf_count, 1500u);  // clusters are uneven, so not quite a third
  options.descriptors_per_leaf = 500;
  EXPECT_EQ(Train(descriptors, options).tree.info().leaf_count, 6u);
  options.descriptors_per_leaf = 1'000'000;
  EXPECT_EQ(Train(descriptors, options).tree.info().leaf_count, 2u);
}

TEST(VocabularyTrainer, SmallSamplesGetMoreWordsADescriptor) {
  EXPECT_TRUE(OptionsForSample(0).Check().ok());
  EXPECT_EQ(OptionsForSample(40'000).descriptors_per_leaf, 1u);
  EXPECT_EQ(OptionsForSample(1'000'000).descriptors_per_leaf, 2u);
}

TEST(VocabularyTrainer, RefusesWhatCannotBeTrainedOn) {
  ThreadPool pool(0);
  const auto code = [&](const std::vector<uint8_t>& descriptors) {
    return TrainVocabulary(descriptors, {}, pool).status().code();
  };
  EXPECT_EQ(code({}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(std::vector<uint8_t>(kCenterSize)), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(std::vector<uint8_t>(2 * kCenterSize + 1)), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(std::vector<uint8_t>(500 * kCenterSize, 9)), StatusCode::kInvalidArgument);
  // Two distinct ones are enough, and duplicates of them end every branch.
  std::vector<uint8_t> two(500 * kCenterSize, 9);
  std::fill(two.begin(), two.begin() + 100 * kCenterSize, uint8_t{10});
  const VocabularyTree tree = Train(two, {}).tree;
  EXPECT_NE(tree.QuantizeAll(two).front(), tree.QuantizeAll(two).back());
  EXPECT_EQ(tree.info().leaf_count, 2u);
}

TEST(VocabularyTrainer, EveryBoundOfItsOptionsIsNoticed) {
  using Options = VocabularyTrainerOptions;
  ExpectBounds<Options, uint32_t>(&Options::branch, "branch", {0, 1, 65}, {2, 64});
  ExpectBounds<Options, uint32_t>(&Options::depth_max, "depth_max", {0, 8}, {1, 7});
  ExpectBounds<Options, uint32_t>(&Options::attempts_per_node, "attempts_per_node", {0, 65},
                                  {1, 64});
  ExpectBounds<Options, uint32_t>(&Options::iterations_max, "iterations_max", {0, 1001}, {1, 1000});
  ExpectBounds<Options, uint32_t>(&Options::descriptors_per_leaf, "descriptors_per_leaf", {0},
                                  {1, UINT32_MAX});
  ExpectBounds<Options, uint32_t>(&Options::node_sample_max, "node_sample_max", {0, 999},
                                  {1000, UINT32_MAX});
  ExpectBounds<Options, uint64_t>(&Options::seed, "seed", {}, {0, UINT64_MAX});
  ThreadPool pool(0);
  EXPECT_EQ(TrainVocabulary(RandomDescriptors(100, 1), {.branch = 1}, pool).status().code(),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
