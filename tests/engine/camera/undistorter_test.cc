// SPDX-License-Identifier: Apache-2.0
// Goal: undistorted photos are right, pixel by pixel, and the cache of tables keeps its bound,
//   builds each table once and serves many threads.
// Method: bilinear interpolation written out here in doubles, on smooth and on noisy photos;
//   tables counted by the cache's own statistics; threads that hammer few cameras in a cache
//   too small for them.
#include "engine/camera/undistorter.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "engine/camera/projection.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

CameraModel Camera(double k1, double k2 = 0, uint32_t width_px = 200, uint32_t height_px = 150) {
  CameraModel model;
  model.width_px = width_px;
  model.height_px = height_px;
  model.fx = 1.0 * width_px;
  model.fy = 1.02 * width_px;
  model.cx = model.u0 = width_px / 2.0 - 3;
  model.cy = model.v0 = height_px / 2.0 + 2;
  model.k1 = k1;
  model.k2 = k2;
  return model;
}

cv::Mat Noise(int width_px, int height_px, int channels, uint64_t seed) {
  SeededRandom random(seed);
  cv::Mat photo(height_px, width_px, CV_8UC(channels));
  for (int v = 0; v < height_px; ++v) {
    for (int i = 0; i < width_px * channels; ++i)
      photo.ptr(v)[i] = static_cast<uint8_t>(random.Below(256));
  }
  return photo;
}

// Bilinear, black outside, at a position in the photo.
double Interpolated(const cv::Mat& photo, double x, double y, int channel) {
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const double fx = x - left, fy = y - top;
  const auto at = [&](int u, int v) -> double {
    if (u < 0 || v < 0 || u >= photo.cols || v >= photo.rows) return 0;
    return photo.ptr(v)[u * photo.channels() + channel];
  };
  return (1 - fy) * ((1 - fx) * at(left, top) + fx * at(left + 1, top)) +
         fy * ((1 - fx) * at(left, top + 1) + fx * at(left + 1, top + 1));
}

TEST(UndistortTable, AgreesWithInterpolationPixelByPixel) {
  const CameraModel cameras[] = {Camera(-0.2), Camera(0.3, -0.1), Camera(-0.3, 0.12), Camera(0.5)};
  for (const CameraModel& base : cameras) {
    for (const int channels : {1, 3}) {
      CameraModel model = base;
      model.u0 += 5;
      const cv::Mat photo = Noise(200, 150, channels, 5);
      const cv::Mat undistorted = (*UndistortTable::Build(model))->Apply(photo).value();
      ASSERT_EQ(undistorted.size(), photo.size());
      ASSERT_EQ(undistorted.type(), photo.type());
      double error_max = 0;
      for (int v = 0; v < 150; ++v) {
        for (int u = 0; u < 200; ++u) {
          const Eigen::Vector2d p = DistortPixel(model, {u, v});
          const double x = std::nearbyint(p.x() * 32) / 32, y = std::nearbyint(p.y() * 32) / 32;
          for (int c = 0; c < channels; ++c) {
            const double expected = Interpolated(photo, x, y, c);
            error_max =
                std::max(error_max, std::abs(expected - undistorted.ptr(v)[u * channels + c]));
          }
        }
      }
      EXPECT_LE(error_max, 1.0) << "k1 = " << model.k1;
    }
  }
}

TEST(UndistortTable, RoundingPositionsHardlyShowsInAPhoto) {
  const CameraModel model = Camera(-0.2, 0.03);
  cv::Mat photo(150, 200, CV_8UC1);
  for (int v = 0; v < 150; ++v) {
    for (int u = 0; u < 200; ++u)
      photo.at<uint8_t>(v, u) = static_cast<uint8_t>(127 + 100 * std::sin(u / 9.0 + v / 7.0));
  }
  const cv::Mat undistorted = (*UndistortTable::Build(model))->Apply(photo).value();
  for (int v = 0; v < 150; ++v) {
    for (int u = 0; u < 200; ++u) {
      const Eigen::Vector2d p = DistortPixel(model, {u, v});
      if (p.x() < 0 || p.y() < 0 || p.x() > 199 || p.y() > 149) continue;
      EXPECT_NEAR(undistorted.at<uint8_t>(v, u), Interpolated(photo, p.x(), p.y(), 0), 2.0);
    }
  }
}

TEST(UndistortTable, IsBlackPastThePhotoAndNowhereElse) {
  const CameraModel model = Camera(0.5);
  const cv::Mat white(150, 200, CV_8UC1, cv::Scalar(255));
  const cv::Mat undistorted = (*UndistortTable::Build(model))->Apply(white).value();
  int black = 0;
  for (int v = 0; v < 150; ++v) {
    for (int u = 0; u < 200; ++u) {
      const int value = undistorted.at<uint8_t>(v, u);
      if (IsInsidePhoto(model, {u, v}, 0)) {
        EXPECT_GE(value, 250) << u << "," << v;  // blended within 1/64 px
      }
      const Eigen::Vector2d p = DistortPixel(model, {u, v});
      if (p.x() < -1.02 || p.y() < -1.02 || p.x() > 200.02 || p.y() > 150.02) {
        EXPECT_EQ(value, 0) << u << "," << v;
        ++black;
      }
    }
  }
  EXPECT_GT(black, 1000);
}

TEST(UndistortTable, RefusesOtherPhotosAndHugeCameras) {
  const auto table = UndistortTable::Build(Camera(-0.1)).value();
  for (const cv::Mat& photo : {cv::Mat(), cv::Mat(150, 201, CV_8UC1), cv::Mat(200, 150, CV_8UC3),
                               cv::Mat(150, 200, CV_16UC1)}) {
    EXPECT_EQ(table->Apply(photo).status().code(), StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(UndistortTable::Build(Camera(-0.1, 0, 32767, 10)).status().code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(UndistortTable::Build(Camera(-3)).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(table->size_bytes(), 200u * 150 * 6);
}

TEST(UndistortCache, ReturnsTheInputWithoutDistortion) {
  UndistortCache cache(1 << 20);
  const cv::Mat photo = Noise(200, 150, 3, 1);
  const cv::Mat same = cache.Undistort(Camera(0), photo).value();
  EXPECT_EQ(same.data, photo.data);
  EXPECT_EQ(cache.stats().build_count, 0u);
  EXPECT_FALSE(cache.Undistort(Camera(0), Noise(10, 10, 3, 1)).ok()) << "not this camera's size";
  CameraModel bad = Camera(0);
  bad.fx = std::nan("");
  EXPECT_FALSE(cache.Undistort(bad, photo).ok());
  EXPECT_FALSE(cache.Table(bad).ok());
}

TEST(UndistortCache, BuildsOnceAndTellsCamerasApart) {
  UndistortCache cache(64 << 20);
  const auto first = cache.Table(Camera(-0.1)).value();
  EXPECT_EQ(cache.Table(Camera(-0.1)).value(), first);
  for (double CameraModel::*field :
       {&CameraModel::fx, &CameraModel::fy, &CameraModel::cx, &CameraModel::cy, &CameraModel::k1,
        &CameraModel::k2, &CameraModel::u0, &CameraModel::v0}) {
    CameraModel other = Camera(-0.1);
    other.*field += 1e-9;
    EXPECT_NE(cache.Table(other).value(), first);
    EXPECT_EQ(cache.Table(other).value()->model(), other);
  }
  EXPECT_EQ(cache.stats().build_count, 9u);
  EXPECT_EQ(cache.stats().hit_count, 9u);
  EXPECT_EQ(cache.stats().table_count, 9u);
}

TEST(UndistortCache, DropsTheLeastRecentlyUsedBeyondItsBytes) {
  const size_t table_bytes = 200 * 150 * 6 + 512;
  UndistortCache cache(3 * table_bytes);
  const auto build_count = [&](double k1) {
    const uint64_t before = cache.stats().build_count;
    EXPECT_TRUE(cache.Table(Camera(k1)).ok());
    EXPECT_LE(cache.stats().size_bytes, 3 * table_bytes);
    return cache.stats().build_count - before;
  };
  EXPECT_EQ(build_count(-0.01), 1u);
  EXPECT_EQ(build_count(-0.02), 1u);
  EXPECT_EQ(build_count(-0.03), 1u);
  EXPECT_EQ(build_count(-0.01), 0u);  // now -0.02 is the oldest
  EXPECT_EQ(build_count(-0.04), 1u);
  EXPECT_EQ(cache.stats().table_count, 3u);
  EXPECT_EQ(build_count(-0.01), 0u);
  EXPECT_EQ(build_count(-0.03), 0u);
  EXPECT_EQ(build_count(-0.04), 0u);
  EXPECT_EQ(build_count(-0.02), 1u);
  EXPECT_EQ(build_count(-0.01), 1u) << "dropped for -0.02";
}

TEST(UndistortCache, ServesATableLargerThanItselfWithoutKeepingIt) {
  UndistortCache cache(1000);
  const cv::Mat photo = Noise(200, 150, 1, 1);
  const auto held = cache.Table(Camera(-0.1)).value();
  EXPECT_TRUE(cache.Undistort(Camera(-0.1), photo).ok());
  EXPECT_EQ(cache.stats().build_count, 2u);
  EXPECT_EQ(cache.stats().table_count, 0u);
  EXPECT_EQ(cache.stats().size_bytes, 0u);
  EXPECT_TRUE(held->Apply(photo).ok()) << "a table outlives its place";
}

TEST(UndistortCache, ReportsAFailedBuildAndForgetsIt) {
  UndistortCache cache(1 << 30);
  for (int i = 1; i <= 2; ++i) {
    EXPECT_EQ(cache.Table(Camera(-0.1, 0, 40000, 20)).status().code(),
              StatusCode::kInvalidArgument);
    EXPECT_EQ(cache.stats().build_count, static_cast<uint64_t>(i));
  }
  EXPECT_EQ(cache.stats().table_count, 0u);
}

TEST(UndistortCache, ThreadsThatWantOneTableBuildItOnce) {
  UndistortCache cache(64 << 20);
  std::atomic<int> ready = 0;
  std::vector<std::shared_ptr<const UndistortTable>> tables(8);
  std::vector<std::thread> threads;
  for (auto& table : tables) {
    threads.emplace_back([&cache, &ready, &table] {
      ++ready;
      while (ready < 8) std::this_thread::yield();
      table = cache.Table(Camera(-0.1, 0, 800, 600)).value();
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& table : tables) EXPECT_EQ(table, tables[0]);
  EXPECT_EQ(cache.stats().build_count, 1u);
  EXPECT_EQ(cache.stats().hit_count, 7u);
}

TEST(UndistortCache, StaysRightUnderManyThreads) {
  constexpr int kCameras = 6;
  constexpr int kThreads = 8;
  constexpr int kRounds = 150;
  const size_t table_bytes = 64 * 48 * 6 + 512;
  UndistortCache cache(4 * table_bytes);  // fewer than the cameras: tables come and go all the time
  const cv::Mat photo = Noise(64, 48, 3, 9);
  std::vector<cv::Mat> expected;
  for (int i = 0; i < kCameras; ++i) {
    expected.push_back(
        (*UndistortTable::Build(Camera(-0.03 * (i + 1), 0, 64, 48)))->Apply(photo).value());
  }
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      SeededRandom random(t);
      for (int round = 0; round < kRounds; ++round) {
        const int i = static_cast<int>(random.Below(kCameras));
        const auto undistorted = cache.Undistort(Camera(-0.03 * (i + 1), 0, 64, 48), photo);
        if (!undistorted.ok() || cv::norm(*undistorted, expected[i], cv::NORM_INF) != 0) ++wrong;
        if (cache.stats().size_bytes > 4 * table_bytes) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  const auto stats = cache.stats();
  EXPECT_EQ(stats.hit_count + stats.build_count, static_cast<uint64_t>(kThreads) * kRounds);
  EXPECT_LE(stats.table_count, 4u);
}

}  // namespace
}  // namespace veduta
