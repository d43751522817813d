// SPDX-License-Identifier: Apache-2.0
// Goal: the tree and the scores together find the images that brute force finds, also those
//   stored after training.
// Method: a synthetic city of sites; an image shows some of its site's spots, seen again with
//   noise, among clutter of its own and spots that every site has. Brute force: each descriptor
//   of the query votes for the images with the nearest descriptors. Its best images must be
//   among the index's first few. Half of the images are unknown to the training. Beside it as a
//   peer: FLANN's hierarchical k-means over as many words, searched as approximate neighbours.
#include <gtest/gtest.h>
#include <flann/flann.hpp>

#include <algorithm>
#include <functional>
#include <map>
#include <string>

#include "index/descriptor_sample.h"
#include "index/scoring.h"
#include "index/vocabulary_trainer.h"
#include "tests/index/synthetic_descriptors.h"

namespace veduta {
namespace {

constexpr uint32_t kSiteCount = 12, kImagesOfSite = 6;
constexpr uint32_t kImageCount = kSiteCount * kImagesOfSite;
constexpr int kNoise = 12;

struct City {
  std::vector<std::vector<uint8_t>> images;  // descriptors; image i shows site i / kImagesOfSite
};

City MakeCity() {
  SeededRandom random(11);
  const std::vector<uint8_t> everywhere = RandomDescriptors(60, 12);
  City city;
  for (uint32_t site = 0; site < kSiteCount; ++site) {
    const size_t spot_count = 120;
    const std::vector<uint8_t> spots = RandomDescriptors(spot_count, MixSeed(13, site));
    for (uint32_t i = 0; i < kImagesOfSite; ++i) {
      // Image i sees spots 15 i .. 15 i + 45: neighbours share 30, those three apart none.
      std::vector<uint8_t> image;
      for (size_t spot = 15 * i; spot < 15 * i + 45; ++spot) {
        Append(&image, SeenAgain(&spots[spot * kCenterSize], kNoise, random));
      }
      for (int j = 0; j < 25; ++j)
        Append(&image, SeenAgain(&everywhere[random.Below(60) * kCenterSize], kNoise, random));
      for (int j = 0; j < 60; ++j) Append(&image, RandomDescriptor(random));
      city.images.push_back(std::move(image));
    }
  }
  return city;
}

class Retrieval : public testing::Test {
 protected:
  using WordsOf = std::function<std::vector<WordId>(const std::vector<uint8_t>&)>;

  // Of every `stride`-th image.
  std::vector<uint8_t> Sample(uint32_t stride) const {
    DescriptorSample sample(5000);
    for (uint32_t i = 0; i < kImageCount; ++i) {
      if (i % stride == 0) sample.Add(HashContent(city_.images[i]).Seed(), city_.images[i]);
    }
    return sample.Take();
  }
  // Trains on every `stride`-th image, then stores all; the number of words.
  uint32_t Build(uint32_t stride, const VocabularyTrainerOptions& options) {
    ThreadPool pool(1);
    const VocabularyTree tree = TrainVocabulary(Sample(stride), options, pool).value().tree;
    Store([&](const std::vector<uint8_t>& image) { return tree.QuantizeAll(image); });
    return tree.info().leaf_count;
  }
  void Store(const WordsOf& words_of) {
    words_.clear();
    postings_.clear();
    for (uint32_t i = 0; i < kImageCount; ++i) {
      words_.push_back(DistinctWords(words_of(city_.images[i])));
      for (const WordId word : words_.back()) postings_[word].emplace_back(i + 1);
    }
  }

  // The k best other images, by index.
  std::vector<uint32_t> IndexBest(uint32_t query, uint32_t k) const {
    std::vector<std::vector<ImageId>> postings;
    for (const WordId word : words_[query]) postings.push_back(postings_.at(word));
    const std::vector<RankedImage> ranked =
        Rank(postings, kImageCount, {.count_max = k + 1}).value();
    EXPECT_EQ(ranked.front().score, 1.0);
    std::vector<uint32_t> best;
    for (const RankedImage& image : ranked) {
      if (image.image.value != query + 1 && best.size() < k) best.push_back(image.image.value - 1);
    }
    return best;
  }

  // The k others with the most votes.
  std::vector<uint32_t> BruteForceBest(uint32_t query, uint32_t k) const {
    const std::vector<uint8_t>& descriptors = city_.images[query];
    std::vector<int> votes(kImageCount, 0);
    for (size_t row = 0; row < descriptors.size(); row += kCenterSize) {
      std::vector<std::pair<int, uint32_t>>
          nearest;  // squared distance to each image's nearest descriptor
      for (uint32_t i = 0; i < kImageCount; ++i) {
        if (i != query)
          nearest.emplace_back(NearestDistance(&descriptors[row], city_.images[i]), i);
      }
      std::sort(nearest.begin(), nearest.end());
      // Every image that shows the spot comes as close as the noise, 2 * 128 * (12 * 13 / 3), makes
      // it; others do not.
      for (const auto& [distance, image] : nearest) {
        if (distance < 2 * 2 * kCenterSize * kNoise * (kNoise + 1) / 3) ++votes[image];
      }
    }
    std::vector<uint32_t> order;
    for (uint32_t i = 0; i < kImageCount; ++i) order.push_back(i);
    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return votes[a] > votes[b]; });
    order.resize(k);
    return order;
  }

  static int NearestDistance(const uint8_t* descriptor, const std::vector<uint8_t>& image) {
    int best = INT32_MAX;
    for (size_t row = 0; row < image.size(); row += kCenterSize) {
      int distance = 0;
      for (int j = 0; j < kCenterSize; ++j) {
        const int d = descriptor[j] - image[row + static_cast<size_t>(j)];
        distance += d * d;
      }
      best = std::min(best, distance);
    }
    return best;
  }

  // Share of brute force's two best that are among the index's k best, over every third image.
  double Recall(uint32_t k) {
    double found = 0, wanted = 0;
    for (uint32_t query = 0; query < kImageCount; query += 3) {
      const std::vector<uint32_t> index_best = IndexBest(query, k);
      for (const uint32_t image : BruteForceBest(query, 2)) {
        ++wanted;
        found += std::count(index_best.begin(), index_best.end(), image) > 0 ? 1 : 0;
      }
    }
    RecordProperty("recall", std::to_string(found / wanted));
    return found / wanted;
  }

  const City city_ = MakeCity();
  std::vector<std::vector<WordId>> words_;
  std::map<WordId, std::vector<ImageId>> postings_;
};

TEST_F(Retrieval, BruteForceFindsTheSite) {  // else the recall below would mean nothing
  for (uint32_t query = 0; query < kImageCount; query += 7) {
    for (const uint32_t image : BruteForceBest(query, 2))
      EXPECT_EQ(image / kImagesOfSite, query / kImagesOfSite);
  }
}

TEST_F(Retrieval, FindsWhatBruteForceFinds) {
  Build(1, {});
  EXPECT_GE(Recall(5), 0.95);
}

TEST_F(Retrieval, FindsImagesStoredAfterTraining) {
  Build(2, {});
  EXPECT_GE(Recall(5), 0.9);
}

// FLANN's tree of k-means gives the centres, and finds the nearest of them; descends several
// branches where ours descends one, so it may find a little more, at many times the distances.
TEST_F(Retrieval, FindsAsMuchAsFlann) {
  const uint32_t word_count = Build(1, {});
  const double ours = Recall(5);

  using Distance = flann::L2<uint8_t>;
  std::vector<uint8_t> sample = Sample(1);
  flann::seed_random(1);
  std::vector<float> centers(size_t{word_count} * kCenterSize);
  flann::Matrix<float> to(centers.data(), word_count, kCenterSize);
  const int center_count = flann::hierarchicalClustering<Distance>(
      {sample.data(), sample.size() / kCenterSize, kCenterSize}, to,
      flann::KMeansIndexParams(10, 11, flann::FLANN_CENTERS_KMEANSPP));
  ASSERT_GT(center_count,
            static_cast<int>(word_count) * 4 / 5);  // nodes too small to split leave some out
  flann::Index<flann::L2<float>> index(
      {centers.data(), static_cast<size_t>(center_count), kCenterSize},
      flann::KMeansIndexParams(10));
  index.buildIndex();
  Store([&](const std::vector<uint8_t>& image) {
    std::vector<float> query(image.begin(), image.end());
    const size_t rows = image.size() / kCenterSize;
    std::vector<int> nearest(rows);
    std::vector<float> distances(rows);
    flann::Matrix<int> nearest_out(nearest.data(), rows, 1);
    flann::Matrix<float> distances_out(distances.data(), rows, 1);
    index.knnSearch({query.data(), rows, kCenterSize}, nearest_out, distances_out, 1,
                    flann::SearchParams(64));
    return std::vector<WordId>(nearest.begin(), nearest.end());
  });
  const double theirs = Recall(5);
  std::cout << word_count << " words: recall " << ours << ", FLANN's " << center_count
            << " words: " << theirs << "\n";
  EXPECT_GE(theirs, 0.8) << "a peer that finds little proves little";
  EXPECT_GE(ours, theirs - 0.03);
}

TEST_F(Retrieval, ACoarseTreeFindsLess) {  // the measure can tell a bad vocabulary from a good one
  VocabularyTrainerOptions options;
  options.branch = 4;
  options.depth_max = 2;
  Build(1, options);
  EXPECT_LT(Recall(5), 0.8);
}

}  // namespace
}  // namespace veduta
