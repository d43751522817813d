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

Status CheckPostings(std::span<const std::vector<ImageId>> postings, uint32_t image_count,
                     uint32_t* id_max) {
  *id_max = 0;
  for (size_t i = 0; i < postings.size(); ++i) {
    const std::vector<ImageId>& images = postings[i];
    if (images.size() > image_count) {
      return Status::InvalidArgument("scoring: word " + std::to_string(i) + " of the query is in " +
                                     std::to_string(images.size()) + " of " +
                                     std::to_string(image_count) + " images");
    }
    uint32_t previous = 0;
    for (const ImageId image : images) {
      if (image.value <= previous) {
        return Status::InvalidArgument("scoring: the images of word " + std::to_string(i) +
                                       " of the query do not ascend at " +
                                       std::to_string(image.value));
      }
      previous = image.value;
    }
    *id_max = std::max(*id_max, previous);
  }
  return Status::Ok();
}

// Adds each word's weight to the sum of every image that has the word.
template <typename Sums>
void AddWeights(std::span<const std::vector<ImageId>> postings, std::span<const uint64_t> weights,
                Sums& sums) {
  for (size_t i = 0; i < postings.size(); ++i) {
    if (weights[i] == 0) continue;
    for (const ImageId image : postings[i]) sums[image.value] += weights[i];
  }
}

}  // namespace

Status RankOptions::Check() const {
  return OptionBounds().Between("score_min", score_min, 0, 1).status();
}

Result<std::vector<RankedImage>> Rank(std::span<const std::vector<ImageId>> postings,
                                      uint32_t image_count, const RankOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  uint32_t id_max = 0;
  VEDUTA_RETURN_IF_ERROR(CheckPostings(postings, image_count, &id_max));
  std::vector<RankedImage> ranked;
  if (id_max == 0) return ranked;

  std::vector<uint64_t> weights(postings.size());
  uint64_t self = 0;
  for (size_t i = 0; i < postings.size(); ++i)
    self += weights[i] = Weight(image_count, postings[i].size());
  if (self == 0) {
    weights.assign(postings.size(), 1);
    self = postings.size();
  }
  const auto keep = [&](uint32_t image, uint64_t sum) {
    const double score = static_cast<double>(sum) / static_cast<double>(self);
    if (sum > 0 && score >= options.score_min) ranked.push_back({ImageId(image), score});
  };
  if (id_max / 8 <= uint64_t{image_count} + 8192) {
    std::vector<uint64_t> sums(size_t{id_max} + 1, 0);
    AddWeights(postings, weights, sums);
    for (uint32_t image = 1; image <= id_max; ++image) keep(image, sums[image]);
  } else {
    std::unordered_map<uint32_t, uint64_t> sums;
    AddWeights(postings, weights, sums);
    for (const auto& [image, sum] : sums) keep(image, sum);
  }
  const auto better = [](const RankedImage& a, const RankedImage& b) {
    return a.score != b.score ? a.score > b.score : a.image < b.image;
  };
  const size_t count = std::min<size_t>(ranked.size(), options.count_max);
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<ptrdiff_t>(count), ranked.end(),
                    better);
  ranked.resize(count);
  return ranked;
}

}  // namespace veduta
