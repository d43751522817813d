// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/retrieval/recall.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <iterator>
#include <sstream>

#include "index/descriptor_sample.h"
#include "index/scoring.h"
#include "storage/base/median.h"
#include "tools/bench/retrieval/memory_peak.h"

namespace veduta::bench {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// The lists of all photos in memory; the id of photo i is i + 1.
class Lists {
 public:
  Lists(const Photos& photos, const VocabularyTree& tree)
      : photos_(photos), postings_(tree.info().leaf_count) {
    for (uint32_t i = 0; i < photos.features.size(); ++i) {
      const auto start = Clock::now();
      words_.push_back(DistinctWords(tree.QuantizeAll(photos.features[i].descriptors)));
      quantize_ms_.push_back(1e3 * SecondsSince(start));
      for (const WordId word : words_[i]) postings_[word].emplace_back(i + 1);
    }
  }

  Result<std::vector<RankedImage>> Query(uint32_t i) {
    std::vector<std::vector<ImageId>> found;
    for (const WordId word : words_[i]) found.push_back(postings_[word]);
    const auto start = Clock::now();
    RankOptions options;
    options.count_max = *std::rbegin(kRanks) + 1;
    auto ranked = Rank(found, static_cast<uint32_t>(words_.size()), options);
    rank_ms_.push_back(1e3 * SecondsSince(start));
    return ranked;
  }

  void Describe(Recall* recall) const {
    recall->query_ms_median = MedianOf(rank_ms_);
    recall->quantize_ms_median = MedianOf(quantize_ms_);
    double words = 0, near = 0, far = 0, near_count = 0, far_count = 0;
    for (uint32_t i = 0; i < words_.size(); ++i) {
      words += static_cast<double>(words_[i].size());
      for (const uint32_t j : photos_.neighbors[i]) near += Shared(i, j), ++near_count;
      // Ten others, spread over all photos.
      for (uint32_t step = 1; step <= 10; ++step) {
        const uint32_t j = static_cast<uint32_t>((i + step * words_.size() / 11) % words_.size());
        const std::vector<uint32_t>& neighbors = photos_.neighbors[i];
        if (j == i || std::binary_search(neighbors.begin(), neighbors.end(), j)) continue;
        far += Shared(i, j), ++far_count;
      }
    }
    recall->words_mean = words / static_cast<double>(words_.size());
    recall->shared_with_neighbor = near / std::max(1.0, near_count);
    recall->shared_with_other = far / std::max(1.0, far_count);
  }

 private:
  double Shared(uint32_t i, uint32_t j) const {
    std::vector<WordId> shared;
    std::set_intersection(words_[i].begin(), words_[i].end(), words_[j].begin(), words_[j].end(),
                          std::back_inserter(shared));
    return static_cast<double>(shared.size());
  }

  const Photos& photos_;
  std::vector<std::vector<WordId>> words_;
  std::vector<std::vector<ImageId>> postings_;
  std::vector<double> quantize_ms_, rank_ms_;
};

// Adds what a query by photo i finds.
void Count(const std::vector<uint32_t>& wanted, uint32_t i, std::vector<RankedImage> ranked,
           SetRecall* recall) {
  ++recall->query_count;
  std::erase_if(ranked, [&](const RankedImage& image) { return image.image.value == i + 1; });
  for (size_t k = 0; k < std::size(kRanks); ++k) {
    double found = 0;
    for (size_t rank = 0; rank < std::min<size_t>(kRanks[k], ranked.size()); ++rank) {
      const uint32_t other = ranked[rank].image.value - 1;
      if (std::binary_search(wanted.begin(), wanted.end(), other)) ++found;
    }
    recall->first_k_right[k] += found > 0 ? 1 : 0;
    recall->neighbors_found[k] += found / static_cast<double>(wanted.size());
  }
}

Result<Recall> MeasureRecall(const Photos& photos, const VocabularyTree& tree) {
  Lists lists(photos, tree);
  Recall recall;
  uint32_t i = 0;
  for (const uint32_t end : photos.set_ends) {
    SetRecall set;
    set.first_k_right.assign(std::size(kRanks), 0);
    set.neighbors_found.assign(std::size(kRanks), 0);
    for (; i < end; ++i) {
      if (photos.neighbors[i].empty()) continue;
      VEDUTA_ASSIGN_OR_RETURN(std::vector<RankedImage> ranked, lists.Query(i));
      Count(photos.neighbors[i], i, std::move(ranked), &set);
    }
    for (size_t k = 0; k < std::size(kRanks); ++k) {
      set.first_k_right[k] /= std::max(1u, set.query_count);
      set.neighbors_found[k] /= std::max(1u, set.query_count);
    }
    recall.sets.push_back(std::move(set));
  }
  lists.Describe(&recall);
  return recall;
}

}  // namespace

Result<Shape> ParseShape(const std::string& text) {
  Shape shape;
  uint32_t* const fields[] = {&shape.branch, &shape.levels, &shape.sample,
                              &shape.descriptors_per_leaf, &shape.attempts};
  size_t count = 0;
  std::istringstream in(text);
  for (std::string field; std::getline(in, field, ','); ++count) {
    const char* const end = field.data() + field.size();
    if (count == std::size(fields) ||
        std::from_chars(field.data(), end, *fields[count]).ptr != end || field.empty()) {
      count = 0;
      break;
    }
  }
  if (count < 3) {
    return Status::InvalidArgument(
        text + ": BRANCH,LEVELS,SAMPLE[,DESCRIPTORS_PER_LEAF[,ATTEMPTS]] expected");
  }
  return shape;
}

Result<TrainedShape> MeasureShape(const Photos& training, const Photos& photos, const Shape& shape,
                                  ThreadPool* pool) {
  ResetMemoryPeak();
  const double before_mb = MemoryNowMb();
  const auto start = Clock::now();
  DescriptorSample sample(shape.sample);
  for (size_t i = 0; i < training.features.size(); ++i)
    sample.Add(training.seeds[i], training.features[i].descriptors);
  const std::vector<uint8_t> descriptors = sample.Take();
  VocabularyTrainerOptions options = OptionsForSample(descriptors.size() / kDescriptorSize);
  options.branch = shape.branch;
  options.depth_max = shape.levels;
  if (shape.descriptors_per_leaf != 0) options.descriptors_per_leaf = shape.descriptors_per_leaf;
  if (shape.attempts != 0) options.attempts_per_node = shape.attempts;
  VEDUTA_ASSIGN_OR_RETURN(const TrainedVocabulary trained,
                          TrainVocabulary(descriptors, options, *pool));
  TrainedShape measured;
  measured.train_s = SecondsSince(start);
  measured.peak_mb = MemoryPeakMb() - before_mb;
  measured.info = trained.tree.info();
  measured.distortion_mean = trained.distortion_mean;
  VEDUTA_ASSIGN_OR_RETURN(measured.recall, MeasureRecall(photos, trained.tree));
  return measured;
}

}  // namespace veduta::bench
