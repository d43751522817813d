// SPDX-License-Identifier: Apache-2.0
#include "index/vocabulary_trainer.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <string>

#include "index/kmeans.h"
#include "storage/base/content_hash.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// An interior node to be split: the descriptors that came to it are a range of the trainer's order.
struct Node {
  size_t begin = 0, end = 0;
  uint64_t seed = 0;
};

struct Split {
  KMeansCenters centers;
  std::vector<size_t> sizes;          // descriptors that went to each child
  std::vector<uint64_t> distortions;  // sum of squared distances of each child
};

class Trainer final {
 public:
  Trainer(std::span<const uint8_t> descriptors, const VocabularyTrainerOptions& options,
          ThreadPool& pool, const std::stop_token& stop)
      : descriptors_(descriptors),
        options_(options),
        pool_(pool),
        stop_(stop),
        order_(descriptors.size() / kCenterSize) {
    std::iota(order_.begin(), order_.end(), 0u);
  }

  Result<TrainedVocabulary> Run() {
    VocabularyParts parts;
    parts.branch = options_.branch;
    parts.training_size = order_.size();
    uint64_t distortion = 0;
    std::vector<Node> level{
        {0, order_.size(), MixSeed(options_.seed, HashContent(descriptors_).Seed())}};
    for (uint32_t depth = 1; !level.empty(); ++depth) {
      std::vector<Split> splits(level.size());
      pool_.ParallelFor(level.size(), [&](size_t i) {
        if (!stop_.stop_requested()) splits[i] = SplitNode(level[i]);
      });
      if (stop_.stop_requested())
        return Status::Cancelled("stopped: the vocabulary was not trained to its end");
      if (depth == 1 && splits[0].centers.count < 2) {
        return Status::InvalidArgument(
            "vocabulary training: the sample has fewer than two distinct descriptors");
      }
      std::vector<Node> next;
      for (size_t i = 0; i < level.size(); ++i) {
        distortion += AppendSplit(level[i], splits[i], depth, &parts, &next);
        splits[i] = {};
      }
      level = std::move(next);
    }
    VEDUTA_ASSIGN_OR_RETURN(VocabularyTree tree, VocabularyTree::FromParts(parts));
    return TrainedVocabulary{std::move(tree),
                             static_cast<double>(distortion) / static_cast<double>(order_.size())};
  }

 private:
  // Children that a node of n descriptors is worth.
  uint32_t ChildCount(size_t n) const {
    const size_t count = n / options_.descriptors_per_leaf;
    return static_cast<uint32_t>(std::min<size_t>(count, options_.branch));
  }

  // The descriptors that a node's k-means sees, contiguous: all, or a random choice in their order
  // (Knuth's algorithm S).
  std::vector<uint8_t> GatherSample(const Node& node) const {
    const size_t n = node.end - node.begin;
    size_t wanted = std::min<size_t>(n, options_.node_sample_max);
    SeededRandom random(MixSeed(node.seed, 0));
    std::vector<uint8_t> sample(wanted * kCenterSize);
    uint8_t* to = sample.data();
    for (size_t i = 0; i < n && wanted > 0; ++i) {
      if (wanted < n - i && random.Below(static_cast<uint32_t>(n - i)) >= wanted) continue;
      std::memcpy(to, descriptors_.data() + size_t{order_[node.begin + i]} * kCenterSize,
                  kCenterSize);
      to += kCenterSize;
      --wanted;
    }
    return sample;
  }

  // Finds a node's centres and sorts its range of the order by child, stably. Ranges of a level are
  // disjoint.
  Split SplitNode(const Node& node) {
    Split split;
    const size_t n = node.end - node.begin;
    {
      const std::vector<uint8_t> sample = GatherSample(node);
      const uint32_t child_count =
          std::max<uint32_t>(2, ChildCount(n));  // the root is split whatever it is worth
      std::vector<KMeansCenters> attempts(options_.attempts_per_node);
      pool_.ParallelFor(attempts.size(), [&](size_t i) {
        attempts[i] = FindCenters(sample, child_count, options_.iterations_max,
                                  MixSeed(node.seed, 1 + i), pool_);
      });
      const auto lower = [](const KMeansCenters& a, const KMeansCenters& b) {
        return a.distortion < b.distortion;
      };
      split.centers = std::move(*std::min_element(attempts.begin(), attempts.end(), lower));
    }
    const std::span<uint32_t> rows = std::span(order_).subspan(node.begin, n);
    std::vector<uint8_t> nearest(n);
    std::vector<uint32_t> distances(n);
    AssignToCenters(descriptors_, rows, split.centers, nearest, distances, pool_);
    split.sizes.assign(split.centers.count, 0);
    split.distortions.assign(split.centers.count, 0);
    for (size_t i = 0; i < n; ++i) {
      ++split.sizes[nearest[i]];
      split.distortions[nearest[i]] += distances[i];
    }
    std::vector<size_t> to(split.centers.count, 0);
    std::partial_sum(split.sizes.begin(), split.sizes.end() - 1, to.begin() + 1);
    const std::vector<uint32_t> before(rows.begin(), rows.end());
    for (size_t i = 0; i < n; ++i) rows[to[nearest[i]]++] = before[i];
    return split;
  }

  // Writes a node and its children; those to be split go to `next`. Returns the distortion of those
  // that are leaves.
  uint64_t AppendSplit(const Node& node, const Split& split, uint32_t depth, VocabularyParts* parts,
                       std::vector<Node>* next) const {
    parts->child_counts.push_back(static_cast<uint8_t>(split.centers.count));
    parts->centers.insert(parts->centers.end(), split.centers.rows.begin(),
                          split.centers.rows.end());
    uint64_t leaf_distortion = 0;
    size_t begin = node.begin;
    for (uint32_t i = 0; i < split.centers.count; ++i) {
      const size_t size = split.sizes[i];
      // A single centre separates nothing: the node holds one value only.
      const bool is_node =
          depth < options_.depth_max && ChildCount(size) > 1 && split.centers.count > 1;
      parts->child_is_node.push_back(is_node ? 1 : 0);
      if (is_node) {
        next->push_back(
            {begin, begin + size, MixSeed(node.seed, 1 + options_.attempts_per_node + i)});
      } else {
        leaf_distortion += split.distortions[i];
      }
      begin += size;
    }
    return leaf_distortion;
  }

  std::span<const uint8_t> descriptors_;
  const VocabularyTrainerOptions& options_;
  ThreadPool& pool_;
  const std::stop_token& stop_;
  std::vector<uint32_t> order_;  // the descriptors, sorted by the node that they came to
};

}  // namespace

Status VocabularyTrainerOptions::Check() const {
  return OptionBounds()
      .Between("branch", branch, kVocabularyBranchMin, kVocabularyBranchMax)
      .Between("depth_max", depth_max, 1, kVocabularyDepthMax)
      .Between("attempts_per_node", attempts_per_node, 1, 64)
      .Between("iterations_max", iterations_max, 1, 1000)
      .AtLeast("descriptors_per_leaf", descriptors_per_leaf, 1)
      .AtLeast("node_sample_max", node_sample_max, 1000)
      .status();
}

VocabularyTrainerOptions OptionsForSample(size_t descriptor_count) {
  VocabularyTrainerOptions options;
  options.descriptors_per_leaf = descriptor_count < 300'000 ? 1 : 2;
  return options;
}

Result<TrainedVocabulary> TrainVocabulary(std::span<const uint8_t> descriptors,
                                          const VocabularyTrainerOptions& options, ThreadPool& pool,
                                          const std::stop_token& stop) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  if (descriptors.size() % kCenterSize != 0) {
    return Status::InvalidArgument("vocabulary training: " + std::to_string(descriptors.size()) +
                                   " bytes are no whole number of descriptors");
  }
  const size_t n = descriptors.size() / kCenterSize;
  if (n < 2 || n > UINT32_MAX) {
    return Status::InvalidArgument("vocabulary training: a sample of " + std::to_string(n) +
                                   " descriptors");
  }
  return Trainer(descriptors, options, pool, stop).Run();
}

}  // namespace veduta
