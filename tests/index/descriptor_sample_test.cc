// SPDX-License-Identifier: Apache-2.0
// Goal: a sample depends on the images and not on their order, holds what it was given and no
//   more, and is uniform.
// Method: descriptors that carry their image's and their own number.
#include "index/descriptor_sample.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "index/center_kernels.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

std::vector<uint8_t> Numbered(uint8_t image, size_t n) {
  std::vector<uint8_t> rows(n * kCenterSize);
  for (size_t i = 0; i < n; ++i) {
    rows[i * kCenterSize] = image;
    rows[i * kCenterSize + 1] = static_cast<uint8_t>(i);
    rows[i * kCenterSize + 2] = static_cast<uint8_t>(i >> 8);
  }
  return rows;
}

std::vector<uint8_t> SampleOf(size_t count_max, const std::vector<uint8_t>& images) {
  DescriptorSample sample(count_max);
  for (const uint8_t image : images)
    sample.Add(MixSeed(image, 7), Numbered(image, 300 + 100u * image));
  return sample.Take();
}

TEST(DescriptorSample, IsIndependentOfOrder) {
  const std::vector<uint8_t> forward = SampleOf(500, {0, 1, 2, 3, 4, 5});
  EXPECT_EQ(forward.size(), 500u * kCenterSize);
  EXPECT_EQ(SampleOf(500, {5, 3, 1, 0, 4, 2}), forward);
  EXPECT_NE(SampleOf(500, {5, 3, 1, 0, 4, 6}), forward);
}

TEST(DescriptorSample, DrawsWithoutReplacementAndUniformly) {
  const std::vector<uint8_t> sample =
      SampleOf(1000, {0, 1, 2, 3, 4, 5});  // of 300 + 400 + ... + 800 = 3300
  std::set<std::pair<int, int>> seen;
  std::vector<double> of_image(6, 0);
  for (size_t i = 0; i < sample.size(); i += kCenterSize) {
    EXPECT_TRUE(seen.emplace(sample[i], sample[i + 1] + 256 * sample[i + 2]).second);
    ++of_image[sample[i]];
  }
  for (int image = 0; image < 6; ++image) {
    const double expected = 1000.0 * (300 + 100 * image) / 3300;
    EXPECT_NEAR(of_image[image], expected, 5 * std::sqrt(expected)) << "image " << image;
  }
}

TEST(DescriptorSample, ComesInTheOrderOfTheNumbersDrawn) {
  for (const size_t count_max : {1u, 2u, 37u, 700u, 5000u}) {
    std::vector<std::pair<uint64_t, std::pair<int, int>>> drawn;
    for (const int image : {0, 1}) {
      for (int i = 0; i < 300 + 100 * image; ++i)
        drawn.push_back(
            {MixSeed(MixSeed(static_cast<uint64_t>(image), 7), static_cast<uint64_t>(i)),
             {image, i}});
    }
    std::sort(drawn.begin(), drawn.end());
    const std::vector<uint8_t> sample = SampleOf(count_max, {0, 1});
    ASSERT_EQ(sample.size(), std::min<size_t>(count_max, drawn.size()) * kCenterSize);
    for (size_t i = 0; i < sample.size() / kCenterSize; ++i) {
      const uint8_t* row = &sample[i * kCenterSize];
      EXPECT_EQ(row[0], drawn[i].second.first) << i;
      EXPECT_EQ(row[1] + 256 * row[2], drawn[i].second.second) << i;
    }
  }
}

TEST(DescriptorSample, KeepsAllWhenFew) {
  EXPECT_EQ(SampleOf(100'000, {0, 1}).size(), 700u * kCenterSize);
  EXPECT_TRUE(SampleOf(0, {0, 1}).empty());
  DescriptorSample sample(10);
  sample.Add(1, Numbered(1, 30));
  EXPECT_EQ(sample.count(), 10u);
  EXPECT_EQ(sample.seen_count(), 30u);
  EXPECT_EQ(sample.Take().size(), 10u * kCenterSize);
  EXPECT_EQ(sample.count(), 0u);
  EXPECT_TRUE(sample.Take().empty());
}

}  // namespace
}  // namespace veduta
