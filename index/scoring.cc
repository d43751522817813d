// SPDX-License-Identifier: Apache-2.0
#include "index/scoring.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// What weights are multiples of; 2^21 words of the greatest weight do not overflow 64 bits.
constexpr double kWeightUnit = 0x1.0p-32;

uint64_t Weight(uint32_t image_count, size_t with_word) {
  const double share =
      static_cast<double>(image_count) / static_cast<double>(std::max<size_t>(with_word, 1));
  return static_cast<uint64_t>(std::llround(std::log(share) / kWeightUnit));
}

Status CheckSizes(std::span<const std::vector<ImageId>> postings, uint32_t image_count) {
  for (size_t i = 0; i < postings.size(); ++i) {
    if (postings[i].size() <= image_count) continue;
    return Status::InvalidArgument("scoring: word " + std::to_string(i) + " of the query is in " +
                                   std::to_string(postings[i].size()) + " of " +
                                   std::to_string(image_count) + " images");
  }
  return Status::Ok();
}

Status CheckAscending(size_t word, std::span<const ImageId> images) {
  uint32_t previous = 0;
  for (const ImageId image : images) {
    if (image.value <= previous) {
      return Status::InvalidArgument("scoring: the images of word " + std::to_string(word) +
                                     " of the query do not ascend at " +
                                     std::to_string(image.value));
    }
    previous = image.value;
  }
  return Status::Ok();
}

// Each word's weight, and what they add up to.
std::vector<uint64_t> Weights(std::span<const std::vector<ImageId>> postings, uint32_t image_count,
                              uint64_t* total) {
  std::vector<uint64_t> weights(postings.size());
  *total = 0;
  for (size_t i = 0; i < postings.size(); ++i)
    *total += weights[i] = Weight(image_count, postings[i].size());
  if (*total == 0) {
    weights.assign(postings.size(), 1);
    *total = postings.size();
  }
  return weights;
}

// Adds each word's weight to the sum of every image that has the word. The lists are checked one by
// one, so that each is in the cache when it is added.
template <typename Sums>
Status AddWeights(std::span<const std::vector<ImageId>> postings, std::span<const uint64_t> weights,
                  Sums& sums) {
  for (size_t i = 0; i < postings.size(); ++i) {
    VEDUTA_RETURN_IF_ERROR(CheckAscending(i, postings[i]));
    if (weights[i] == 0) continue;
    for (const ImageId image : postings[i]) sums[image.value] += weights[i];
  }
  return Status::Ok();
}

// The images of the greatest sums among all that are offered.
class BestSums {
 public:
  explicit BestSums(size_t count_max) : count_max_(count_max) {}

  // Images may be offered in any order.
  void Offer(uint32_t image, uint64_t sum) {
    if (sum < sum_min_ || count_max_ == 0) return;
    best_.push_back({sum, image});
    if (best_.size() >= 2 * count_max_ + kSlack) Shrink();
  }

  struct Sum {
    uint64_t sum;
    uint32_t image;
  };
  // Greatest first, equal sums by ascending image.
  std::vector<Sum> Take() {
    Shrink();
    std::sort(best_.begin(), best_.end(), Better);
    return std::move(best_);
  }

 private:
  // So that few images are not sorted again and again; chosen by hand.
  static constexpr size_t kSlack = 256;

  static bool Better(const Sum& a, const Sum& b) {
    return a.sum != b.sum ? a.sum > b.sum : a.image < b.image;
  }

  void Shrink() {
    if (best_.size() <= count_max_) return;
    const auto last = best_.begin() + static_cast<ptrdiff_t>(count_max_) - 1;
    std::nth_element(best_.begin(), last, best_.end(), Better);
    sum_min_ = last->sum;
    best_.resize(count_max_);
  }

  const size_t count_max_;
  uint64_t sum_min_ = 1;
  std::vector<Sum> best_;
};

}  // namespace

Status RankOptions::Check() const {
  return OptionBounds().Between("score_min", score_min, 0, 1).status();
}

Result<std::vector<RankedImage>> Rank(std::span<const std::vector<ImageId>> postings,
                                      uint32_t image_count, const RankOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckSizes(postings, image_count));
  uint32_t id_max = 0;  // lists ascend
  for (const std::vector<ImageId>& images : postings)
    if (!images.empty()) id_max = std::max(id_max, images.back().value);
  std::vector<RankedImage> ranked;
  if (id_max == 0) {  // lists are empty, or wrong
    for (size_t i = 0; i < postings.size(); ++i)
      VEDUTA_RETURN_IF_ERROR(CheckAscending(i, postings[i]));
    return ranked;
  }

  uint64_t self = 0;
  const std::vector<uint64_t> weights = Weights(postings, image_count, &self);
  BestSums best(options.count_max);
  if (id_max / 8 <= uint64_t{image_count} + 8192) {
    std::vector<uint64_t> sums(size_t{id_max} + 1, 0);
    VEDUTA_RETURN_IF_ERROR(AddWeights(postings, weights, sums));
    for (uint32_t image = 1; image <= id_max; ++image) best.Offer(image, sums[image]);
  } else {
    std::unordered_map<uint32_t, uint64_t> sums;
    VEDUTA_RETURN_IF_ERROR(AddWeights(postings, weights, sums));
    for (const auto& [image, sum] : sums) best.Offer(image, sum);
  }
  for (const auto& [sum, image] : best.Take()) {
    const double score = static_cast<double>(sum) / static_cast<double>(self);
    if (score >= options.score_min) ranked.push_back({ImageId(image), score});
  }
  return ranked;
}

}  // namespace veduta
