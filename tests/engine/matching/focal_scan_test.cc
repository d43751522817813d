// SPDX-License-Identifier: Apache-2.0
// Goal: matches of photos say about which focal length they were taken with, whatever it is, with
//   outliers too; the same on any number of threads; wrong options are refused.
// Method: points before cameras of known pose, with noise, projected with several focal lengths.
#include "engine/matching/focal_scan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "storage/base/content_hash.h"
#include "storage/base/transform.h"

namespace veduta {
namespace {

constexpr double kSidePx = 1000;

// Photos of one box, each pair from two distances: where both photos look at one place from as far,
// no pair tells the focal length (Sturm, "On focal length calibration from two views", 2001).
std::vector<CenteredMatches> PairsOf(double focal_px, double outlier_share, uint64_t seed) {
  SeededRandom random(seed);
  std::vector<CenteredMatches> pairs(4);
  const double distance = 6 * focal_px / kSidePx;
  for (size_t k = 0; k < pairs.size(); ++k) {
    const double angle = 0.15 + 0.1 * static_cast<double>(k);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(angle, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3d p{5 * random.Unit() - 2.5, 4 * random.Unit() - 2,
                              4 * random.Unit() - 2};
      const Eigen::Vector3d middle_a(0, 0, distance), middle_b(0.4, -0.3, 0.7 * distance);
      Eigen::Vector2d a = focal_px * (p + middle_a).hnormalized();
      Eigen::Vector2d b = focal_px * (turn * p + middle_b).hnormalized();
      a += Eigen::Vector2d{0.6 * random.Unit() - 0.3, 0.6 * random.Unit() - 0.3};
      if (random.Unit() < outlier_share)
        b = Eigen::Vector2d{kSidePx * (random.Unit() - 0.5), kSidePx * (random.Unit() - 0.5)};
      pairs[k].a.push_back(a);
      pairs[k].b.push_back(b);
    }
  }
  return pairs;
}

TEST(FocalScan, TheRightOneComesFirst) {
  ThreadPool pool(1);
  for (const double focal_px : {600.0, 900.0, 1500.0}) {
    for (const double outlier_share : {0.0, 0.3}) {
      for (const uint64_t seed : {1, 2, 3}) {
        const auto pairs = PairsOf(focal_px, outlier_share, seed);
        const std::vector<double> best = RankFocalLengths(pairs, kSidePx, {}, &pool);
        ASSERT_FALSE(best.empty());
        EXPECT_NEAR(best.front() / focal_px, 1, 0.16) << focal_px << " " << outlier_share;
      }
    }
  }
}

TEST(FocalScan, AnyNumberOfThreadsSaysTheSame) {
  ThreadPool none(0), three(3);
  const auto pairs = PairsOf(800, 0.3, 4);
  EXPECT_EQ(RankFocalLengths(pairs, kSidePx, {}, &none),
            RankFocalLengths(pairs, kSidePx, {}, &three));
}

TEST(FocalScan, WhatExplainsNothingIsLeftOut) {
  ThreadPool pool(0);
  EXPECT_TRUE(RankFocalLengths({}, kSidePx, {}, &pool).empty());
  const auto noise = PairsOf(800, 1, 5);
  EXPECT_TRUE(RankFocalLengths(noise, kSidePx, {}, &pool).empty());
}

TEST(FocalScan, WrongOptionsAreNamed) {
  EXPECT_TRUE(FocalScanOptions().Check().ok());
  const auto refused = [](const char* name, auto&& change) {
    FocalScanOptions options;
    change(&options);
    EXPECT_NE(options.Check().message().find(name), std::string::npos) << name;
  };
  refused("share_min", [](FocalScanOptions* o) { o->share_min = 0; });
  refused("share_max", [](FocalScanOptions* o) { o->share_max = o->share_min; });
  refused("count", [](FocalScanOptions* o) { o->count = 1; });
  refused("two_view.error_px_max", [](FocalScanOptions* o) { o->two_view.error_px_max = 0; });
}

}  // namespace
}  // namespace veduta
