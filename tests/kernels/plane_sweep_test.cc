// SPDX-License-Identifier: Apache-2.0
// Goal: plane sweep and scanline optimisation give the same bits on the device and in C++, at
//   any number of threads, and what the header says: costs of the right plane vanish, blocked
//   and unseen views do no harm, bad input is refused.
// Method: seeded random images and volumes at awkward sizes (one block, one more, odd, tiny)
//   and geometries (sensors that look away, points behind, steps through infinity), device
//   beside C++; small cases against plain loops.
#include "kernels/plane_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <stop_token>
#include <thread>

#include "kernels/scanline.h"
#include "storage/base/content_hash.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

// Null, with a word, where this machine has no device.
Device* TestDevice() {
  static const std::unique_ptr<Device> device = [] {
    Result<std::unique_ptr<Device>> opened = Device::Open({});
    return opened.ok() ? std::move(opened).value() : nullptr;
  }();
  return device.get();
}

struct Image {
  Image(uint32_t width, uint32_t height, uint64_t seed, uint32_t levels = 256)
      : width_px(width), height_px(height), pixels(static_cast<size_t>(width) * height) {
    SeededRandom random(seed);
    for (uint8_t& pixel : pixels) pixel = static_cast<uint8_t>(random.Below(levels));
  }
  GrayView view() const { return {width_px, height_px, pixels.data()}; }
  uint32_t width_px, height_px;
  std::vector<uint8_t> pixels;
};

// Sensor sees the key view's pixel x at x - shift * w.
SweepSensor Shifted(const Image& image, float shift) {
  return {image.view(), {1, 0, 0, 0, 1, 0, 0, 0, 1}, {-shift, 0, 0}};
}

ScanlineOptions Penalties() {
  ScanlineOptions options;
  for (size_t i = 0; i < 256; ++i) options.penalty_large[i] = static_cast<uint8_t>(128 - i / 4);
  return options;
}

struct Size {
  uint32_t width, height, planes, sensors;
};
constexpr Size kSizes[] = {{2, 2, 2, 1},    {1 + 16, 3, 16, 1}, {33, 18, 17, 2},
                           {64, 49, 33, 3}, {51, 5, 31, 5},     {3, 70, 64, 2}};

struct RandomProblem {
  explicit RandomProblem(const Size& size) : key(size.width, size.height, size.planes) {
    SeededRandom random(size.width * 1000 + size.planes);
    const auto near = [&](double value, double range) {
      return static_cast<float>(value + (random.Unit() - 0.5) * range);
    };
    for (uint32_t s = 0; s < size.sensors; ++s) {
      const uint32_t width = 2 + random.Below(60), height = 2 + random.Below(60);
      images.emplace_back(width, height, s + 7);
    }
    for (const Image& image : images) {
      SweepSensor sensor;
      sensor.image = image.view();
      for (size_t i = 0; i < 9; ++i)
        sensor.rotation[i] = near(i % 4 == 0 ? 1 : 0, i < 6 ? 0.3 : 0.02);
      for (float& t : sensor.translation) t = near(0, 20);
      problem.sensors.push_back(sensor);
    }
    problem.key = key.view();
    for (uint32_t k = 0; k < size.planes;
         ++k) {  // through infinity and behind, at any slant, with gaps
      problem.planes.push_back(
          {near(0, 0.01), near(0, 0.01),
           -0.2f + 1.3f * static_cast<float>(k) / static_cast<float>(size.planes)});
      if (k % 7 == 5) problem.planes.back() = SweepPlane::Gap();
    }
  }
  void AddBase() {
    SeededRandom random(5);
    for (size_t i = 0; i < key.pixels.size(); ++i)
      problem.base.push_back(static_cast<float>(random.Unit()));
    problem.base[0] = std::numeric_limits<float>::infinity();
    problem.base[1] = std::numeric_limits<float>::quiet_NaN();
  }
  Image key;
  std::vector<Image> images;
  SweepProblem problem;
};

void ExpectSame(const PlaneChoice& a, const PlaneChoice& b) {
  EXPECT_EQ(a.plane, b.plane);
  EXPECT_EQ(a.cost_before, b.cost_before);
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.cost_after, b.cost_after);
  EXPECT_EQ(a.cost_second, b.cost_second);
}

TEST(PlaneSweep, DeviceAndReferenceAgree) {
  if (TestDevice() == nullptr) GTEST_SKIP() << "no OpenCL device";
  ThreadPool pool(1);
  for (const Size& size : kSizes) {
    for (const bool with_base : {false, true}) {
      RandomProblem random(size);
      if (with_base) random.AddBase();
      const CostVolume device = SweepPlanes(random.problem, TestDevice(), pool).value();
      const CostVolume reference = SweepPlanes(random.problem, nullptr, pool).value();
      ASSERT_EQ(device.costs, reference.costs)
          << size.width << "x" << size.height << " base " << with_base;
      ExpectSame(SweepAndChoose(random.problem, Penalties(), TestDevice(), pool).value(),
                 ChoosePlanes(reference, random.problem.key, Penalties(), nullptr, pool).value());
    }
  }
}

TEST(PlaneSweep, ThreadsDoNotMatter) {
  ThreadPool alone(0), three(3);
  const RandomProblem random({40, 120, 20, 3});
  EXPECT_EQ(SweepPlanes(random.problem, nullptr, alone)->costs,
            SweepPlanes(random.problem, nullptr, three)->costs);
  ExpectSame(SweepAndChoose(random.problem, Penalties(), nullptr, alone).value(),
             SweepAndChoose(random.problem, Penalties(), nullptr, three).value());
}

// Of nobody, and of somebody who has not asked yet.
TEST(PlaneSweep, WhoMayAskToStopChangesNothing) {
  const std::stop_source nobody_has_asked;
  const std::stop_token stop = nobody_has_asked.get_token();
  ThreadPool pool(2);
  const RandomProblem random({40, 120, 20, 3});
  for (Device* const device : {static_cast<Device*>(nullptr), TestDevice()}) {
    EXPECT_EQ(SweepPlanes(random.problem, device, pool)->costs,
              SweepPlanes(random.problem, device, pool, stop)->costs);
    ExpectSame(SweepAndChoose(random.problem, Penalties(), device, pool).value(),
               SweepAndChoose(random.problem, Penalties(), device, pool, stop).value());
  }
}

TEST(PlaneSweep, IsCancelledAfterARequestToStop) {
  std::stop_source asked;
  asked.request_stop();
  const std::stop_token stop = asked.get_token();
  ThreadPool pool(2);
  const RandomProblem random({40, 120, 20, 3});
  const CostVolume volume = SweepPlanes(random.problem, nullptr, pool).value();
  for (Device* const device : {static_cast<Device*>(nullptr), TestDevice()}) {
    EXPECT_EQ(SweepPlanes(random.problem, device, pool, stop).status().code(),
              StatusCode::kCancelled);
    EXPECT_EQ(SweepAndChoose(random.problem, Penalties(), device, pool, stop).status().code(),
              StatusCode::kCancelled);
    EXPECT_EQ(
        ChoosePlanes(volume, random.problem.key, Penalties(), device, pool, stop).status().code(),
        StatusCode::kCancelled);
  }
}

// Stopped after a tenth of the time that all of it takes, it ends long before that time is over.
TEST(PlaneSweep, EndsSoonAfterARequestToStop) {
  using Clock = std::chrono::steady_clock;
  ThreadPool pool(0);
  const RandomProblem random({400, 300, 1000, 3});
  const Clock::time_point begin = Clock::now();
  ASSERT_TRUE(SweepAndChoose(random.problem, Penalties(), nullptr, pool).ok());
  const Clock::duration whole = Clock::now() - begin;
  std::stop_source asked;
  const Clock::time_point again = Clock::now();
  const std::jthread asking([&] {
    std::this_thread::sleep_for(whole / 10);
    asked.request_stop();
  });
  EXPECT_EQ(
      SweepAndChoose(random.problem, Penalties(), nullptr, pool, asked.get_token()).status().code(),
      StatusCode::kCancelled);
  EXPECT_LT(Clock::now() - again, whole / 2);
}

// A sensor view that shows the key view moved by 5 px, with another exposure.
TEST(PlaneSweep, TheRightPlaneIsTheCheapestAtAnyExposure) {
  constexpr uint32_t kWidth = 60, kHeight = 20, kShift = 5, kPlanes = 12;
  const Image key(kWidth, kHeight, 3, 100);
  const auto sweep = [&](double contrast, double brightness) {
    Image moved = key;
    for (uint32_t i = 0; i + kShift < moved.pixels.size(); ++i) {
      moved.pixels[i] = static_cast<uint8_t>(key.pixels[i + kShift] * contrast + brightness);
    }
    SweepProblem problem;
    problem.key = key.view();
    problem.sensors = {Shifted(moved, 1)};
    for (uint32_t k = 0; k < kPlanes; ++k)
      problem.planes.push_back({0, 0, static_cast<float>(k)});  // disparity in px
    ThreadPool pool(0);
    return SweepPlanes(problem, nullptr, pool).value();
  };
  const CostVolume brighter = sweep(1, 70), richer = sweep(1.5, 0);
  ASSERT_EQ(brighter.plane_stride, 16u);
  uint32_t count = 0, right = 0;
  for (uint32_t y = 0; y < kHeight; ++y) {
    for (uint32_t x = 0; x < kWidth; ++x) {
      const uint8_t* costs = &brighter.costs[(y * kWidth + x) * 16];
      for (uint32_t k = x + 1; k < kPlanes; ++k) EXPECT_EQ(costs[k], kUnseenCost);
      for (uint32_t k = kPlanes; k < 16; ++k) EXPECT_EQ(costs[k], kCostMax);
      if (x < kShift + 3 || x + 3 >= kWidth) continue;
      EXPECT_EQ(costs[kShift], 0) << x << " " << y;
      const uint8_t* others = &richer.costs[(y * kWidth + x) * 16];
      ++count;
      right += std::min_element(others, others + kPlanes) - others == kShift;
    }
  }
  EXPECT_GT(right, 0.95 * count);
}

TEST(PlaneSweep, ABlockedOrMissingViewDoesNoHarm) {
  const Image key(40, 20, 3), other(40, 20, 4);
  SweepSensor away = Shifted(key, 0);
  away.rotation = {1, 0, 0, 0, 1, 0, 0, 0, -1};  // everything is behind it
  SweepProblem problem;
  problem.key = key.view();
  for (uint32_t k = 0; k < 4; ++k) problem.planes.push_back({0, 0, static_cast<float>(k)});
  ThreadPool pool(0);
  const auto costs = [&](std::vector<SweepSensor> sensors) {
    problem.sensors = std::move(sensors);
    return SweepPlanes(problem, nullptr, pool).value().costs;
  };
  const std::vector<uint8_t> one = costs({Shifted(key, 1)});
  EXPECT_EQ(costs({Shifted(key, 1), away}), one);
  EXPECT_EQ(costs({away, away, Shifted(key, 1)}), one);
  EXPECT_EQ(costs({away})[0], kUnseenCost);
  const std::vector<uint8_t> with_other = costs({Shifted(key, 1), Shifted(other, 1)});
  for (size_t i = 0; i < one.size(); ++i) EXPECT_LE(with_other[i], one[i]);
  // Of three, the mean of the best two: twice the true view outvotes the other.
  EXPECT_EQ(costs({Shifted(key, 1), Shifted(key, 1), Shifted(other, 1)})[(10 * 40 + 20) * 16], 0);
}

CostVolume RandomVolume(const Size& size) {
  CostVolume volume{size.width, size.height, size.planes, PlaneStride(size.planes), {}};
  volume.costs.assign(static_cast<size_t>(size.width) * size.height * volume.plane_stride,
                      kCostMax);
  SeededRandom random(size.planes);
  for (size_t i = 0; i < volume.costs.size(); ++i) {
    if (i % volume.plane_stride < size.planes)
      volume.costs[i] = static_cast<uint8_t>(random.Below(kCostMax + 1u));
  }
  return volume;
}

// The equations of the header, as they stand there.
std::vector<uint32_t> PlainSums(const CostVolume& v, const Image& key,
                                const ScanlineOptions& options) {
  std::vector<uint32_t> sums(v.costs.size(), 0);
  const int width = static_cast<int>(v.width_px), height = static_cast<int>(v.height_px);
  const int count = static_cast<int>(v.plane_stride);
  for (const auto& [dx, dy] :
       {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}}) {
    std::vector<int> path(v.costs.size());
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        const int y = dy < 0 ? height - 1 - j : j, x = dx < 0 ? width - 1 - i : i;
        const int px = x - dx, py = y - dy;
        const bool starts = px < 0 || py < 0 || px >= width || py >= height;
        const int* before =
            starts ? nullptr : &path[static_cast<size_t>((py * width + px) * count)];
        const int least = starts ? 0 : *std::min_element(before, before + count);
        const int large = starts ? 0
                                 : options.penalty_large[static_cast<size_t>(
                                       std::abs(key.pixels[static_cast<size_t>(py * width + px)] -
                                                key.pixels[static_cast<size_t>(y * width + x)]))];
        const auto m = [&](int k) {
          if (starts) return 0;
          return k < 0 || k >= count ? 1 << 20 : std::min(before[k] - least, large);
        };
        for (int k = 0; k < count; ++k) {
          const size_t at = static_cast<size_t>((y * width + x) * count + k);
          path[at] = v.costs[at] + std::min({m(k), m(k - 1) + options.penalty_small,
                                             m(k + 1) + options.penalty_small});
          sums[at] += static_cast<uint32_t>(path[at]);
        }
      }
    }
  }
  return sums;
}

TEST(Scanline, FollowsItsEquations) {
  ThreadPool pool(1);
  for (const Size& size : kSizes) {
    const CostVolume volume = RandomVolume(size);
    const Image key(size.width, size.height, 9);
    const PlaneChoice choice = ChoosePlanes(volume, key.view(), Penalties(), nullptr, pool).value();
    const std::vector<uint32_t> sums = PlainSums(volume, key, Penalties());
    for (size_t pixel = 0; pixel < choice.plane.size(); ++pixel) {
      const auto begin = sums.begin() + static_cast<ptrdiff_t>(pixel * volume.plane_stride);
      const auto best = std::min_element(begin, begin + size.planes);
      ASSERT_EQ(choice.plane[pixel], best - begin);
      EXPECT_EQ(choice.cost[pixel], *best);
      EXPECT_EQ(choice.cost_before[pixel], best == begin ? UINT16_MAX : *(best - 1));
      EXPECT_EQ(choice.cost_after[pixel],
                best + 1 == begin + size.planes ? UINT16_MAX : *(best + 1));
      uint32_t second = UINT16_MAX;
      for (auto it = begin; it != begin + size.planes; ++it) {
        if (std::abs(it - best) > 1) second = std::min(second, *it);
      }
      EXPECT_EQ(choice.cost_second[pixel], second);
    }
  }
}

TEST(Scanline, DeviceAndReferenceAgree) {
  if (TestDevice() == nullptr) GTEST_SKIP() << "no OpenCL device";
  ThreadPool pool(1);
  for (const Size& size : kSizes) {
    const CostVolume volume = RandomVolume(size);
    const Image key(size.width, size.height, 9);
    ExpectSame(ChoosePlanes(volume, key.view(), Penalties(), TestDevice(), pool).value(),
               ChoosePlanes(volume, key.view(), Penalties(), nullptr, pool).value());
  }
}

TEST(PlaneSweep, RefusesBadInput) {
  ThreadPool pool(0);
  const RandomProblem good({20, 20, 4, 1});
  const auto refuses = [&](const char* word, const auto& change) {
    SweepProblem problem = good.problem;
    change(problem);
    const Status status = SweepPlanes(problem, nullptr, pool).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << word;
    EXPECT_NE(status.message().find(word), std::string::npos) << status.message();
    EXPECT_FALSE(SweepAndChoose(problem, Penalties(), nullptr, pool).ok());
  };
  refuses("the key view is 1x20", [](SweepProblem& p) { p.key.width_px = 1; });
  refuses("65536", [](SweepProblem& p) { p.key.height_px = 65536; });
  refuses("without pixels", [](SweepProblem& p) { p.sensors[0].image.pixels = nullptr; });
  refuses("0 sensor views", [](SweepProblem& p) { p.sensors.clear(); });
  refuses("17 sensor views", [](SweepProblem& p) { p.sensors.resize(17, p.sensors[0]); });
  refuses("1 planes", [](SweepProblem& p) { p.planes.resize(1); });
  refuses("1025 planes", [](SweepProblem& p) { p.planes.resize(1025); });
  refuses("the base has 3", [](SweepProblem& p) { p.base.resize(3); });
  refuses("plane is not finite",
          [](SweepProblem& p) { p.planes[1].y = std::numeric_limits<float>::infinity(); });
  refuses("geometry is not finite", [](SweepProblem& p) {
    p.sensors[0].rotation[3] = std::numeric_limits<float>::quiet_NaN();
  });
}

TEST(ScanlineOptions, EveryBoundIsNoticed) {
  ExpectBounds<ScanlineOptions, uint8_t>(&ScanlineOptions::penalty_small, "penalty_small",
                                         {128, 255}, {0, 127});
  for (const size_t difference : {size_t{0}, size_t{100}, size_t{255}}) {
    ScanlineOptions options;
    options.penalty_large[difference] = 128;
    EXPECT_TRUE(options.Check().ok());
    options.penalty_large[difference] = 129;
    EXPECT_EQ(options.Check().message(), "penalty_large is 129, but must be from 0 to 128");
  }
}

TEST(Scanline, RefusesBadInput) {
  ThreadPool pool(0);
  const Size size{20, 10, 5, 1};
  const Image key(20, 10, 1), other(10, 20, 1);
  ScanlineOptions options = Penalties();
  CostVolume volume = RandomVolume(size);
  EXPECT_FALSE(ChoosePlanes(volume, other.view(), options, nullptr, pool).ok());
  volume.costs.pop_back();
  EXPECT_FALSE(ChoosePlanes(volume, key.view(), options, nullptr, pool).ok());
  volume.costs.push_back(128);
  EXPECT_NE(ChoosePlanes(volume, key.view(), options, nullptr, pool).status().message().find("128"),
            std::string::npos);
  volume.costs.back() = 0;
  EXPECT_TRUE(ChoosePlanes(volume, key.view(), options, nullptr, pool).ok());
  options.penalty_large[255] = 129;
  EXPECT_NE(ChoosePlanes(volume, key.view(), options, nullptr, pool).status().message().find("129"),
            std::string::npos);
  options = Penalties();
  options.penalty_small = 128;
  EXPECT_FALSE(ChoosePlanes(volume, key.view(), options, nullptr, pool).ok());
}

}  // namespace
}  // namespace veduta
