// SPDX-License-Identifier: Apache-2.0
// Goal: the centres are a fixed point of Lloyd's iteration, the distortion is what it says, and
//   threads change nothing.
// Method: means and nearest centres computed plainly in 64 bits; clusters far apart, which have
//   to be found.
#include "index/kmeans.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

#include "tests/index/synthetic_descriptors.h"

namespace veduta {
namespace {

struct Plain {
  std::vector<uint8_t> nearest;
  std::vector<uint32_t> distances;
  uint64_t distortion = 0;
};

Plain AssignPlainly(const std::vector<uint8_t>& descriptors, const std::vector<uint8_t>& centers) {
  Plain plain;
  for (size_t row = 0; row < descriptors.size(); row += kCenterSize) {
    uint32_t best_distance = UINT32_MAX;
    size_t best = 0;
    for (size_t c = 0; c < centers.size(); c += kCenterSize) {
      uint32_t distance = 0;
      for (size_t j = 0; j < kCenterSize; ++j) {
        const int d = descriptors[row + j] - centers[c + j];
        distance += static_cast<uint32_t>(d * d);
      }
      if (distance < best_distance) {
        best_distance = distance;
        best = c / kCenterSize;
      }
    }
    plain.nearest.push_back(static_cast<uint8_t>(best));
    plain.distances.push_back(best_distance);
    plain.distortion += best_distance;
  }
  return plain;
}

TEST(KMeans, EndsWhereEachCenterIsItsClustersMean) {
  const std::vector<uint8_t> descriptors = ClusteredDescriptors(3000, 40, 30, 1);
  ThreadPool pool(1);
  for (const uint32_t count : {2u, 10u, 64u}) {
    const KMeansCenters centers = FindCenters(descriptors, count, 1000, 5, pool);
    ASSERT_EQ(centers.count, count);
    const Plain plain = AssignPlainly(descriptors, centers.rows);
    EXPECT_EQ(centers.distortion, plain.distortion);
    for (uint32_t c = 0; c < count; ++c) {
      for (size_t j = 0; j < kCenterSize; ++j) {
        double sum = 0, size = 0;
        for (size_t i = 0; i < plain.nearest.size(); ++i) {
          if (plain.nearest[i] != c) continue;
          sum += descriptors[i * kCenterSize + j];
          ++size;
        }
        ASSERT_GT(size, 0);
        ASSERT_LE(std::abs(sum / size - centers.rows[c * kCenterSize + j]), 0.5)
            << "center " << c << " bin " << j;
      }
    }
  }
}

TEST(KMeans, RoundsLowerTheDistortion) {
  const std::vector<uint8_t> descriptors = ClusteredDescriptors(4000, 100, 20, 2);
  ThreadPool pool(0);
  const uint64_t one = FindCenters(descriptors, 16, 1, 3, pool).distortion;
  const uint64_t ten = FindCenters(descriptors, 16, 10, 3, pool).distortion;
  EXPECT_LT(static_cast<double>(ten), 0.99 * static_cast<double>(one));
}

TEST(KMeans, FindsClustersFarApart) {
  const std::vector<uint8_t> descriptors = ClusteredDescriptors(2000, 10, 3, 3);
  ThreadPool pool(1);
  const KMeansCenters centers = FindCenters(descriptors, 10, 20, 4, pool);
  // Uniform noise of +-3 has a variance of 4 a bin (less where 0 clamps it); one cluster split in
  // two at the expense of others would give thousands.
  EXPECT_LT(centers.distortion / 2000, 4u * kCenterSize + kCenterSize);
}

TEST(KMeans, StopsAtDistinctDescriptors) {
  ThreadPool pool(1);
  std::vector<uint8_t> descriptors;
  for (int i = 0; i < 30; ++i)
    Append(&descriptors, std::vector<uint8_t>(kCenterSize, static_cast<uint8_t>(50 * (i % 3))));
  const KMeansCenters centers = FindCenters(descriptors, 10, 10, 1, pool);
  EXPECT_EQ(centers.count, 3u);
  EXPECT_EQ(centers.distortion, 0u);
  std::set<uint8_t> levels;
  for (size_t c = 0; c < 3; ++c) levels.insert(centers.rows[c * kCenterSize]);
  EXPECT_EQ(levels, (std::set<uint8_t>{0, 50, 100}));
  const KMeansCenters one = FindCenters(std::span(descriptors).first(kCenterSize), 10, 10, 1, pool);
  EXPECT_EQ(one.count, 1u);
  // The mean of 0, 50 and 100 in equal parts.
  const KMeansCenters mean = FindCenters(descriptors, 1, 10, 1, pool);
  EXPECT_EQ(mean.rows, std::vector<uint8_t>(kCenterSize, 50));
}

TEST(KMeans, DoesNotDependOnThreads) {
  const std::vector<uint8_t> descriptors =
      ClusteredDescriptors(20'000, 50, 40, 6);  // several chunks
  std::vector<uint32_t> rows(15'000);
  std::iota(rows.begin(), rows.end(), 4000u);
  const size_t subset = size_t{4000} * kCenterSize;
  std::vector<KMeansCenters> found;
  for (const size_t threads : {0u, 1u, 4u}) {
    ThreadPool pool(threads);
    found.push_back(FindCenters(descriptors, 8, 6, 7, pool));
    EXPECT_EQ(found.back().rows, found.front().rows);
    EXPECT_EQ(found.back().distortion, found.front().distortion);
    std::vector<uint8_t> nearest(rows.size());
    std::vector<uint32_t> distances(rows.size());
    AssignToCenters(descriptors, rows, found.front(), nearest, distances, pool);
    const Plain plain = AssignPlainly(
        {descriptors.begin() + subset,
         descriptors.begin() + subset + static_cast<ptrdiff_t>(rows.size()) * kCenterSize},
        found.front().rows);
    EXPECT_EQ(nearest, plain.nearest);
    EXPECT_EQ(distances, plain.distances);
  }
  ThreadPool pool(0);
  EXPECT_NE(FindCenters(descriptors, 8, 6, 8, pool).rows, found.front().rows);  // the seed matters
}

}  // namespace
}  // namespace veduta
