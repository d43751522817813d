// SPDX-License-Identifier: Apache-2.0
// Goal: depth maps of known surfaces are right, whatever the exposure, slant or occlusion; the
//   same on the device, in C++ and at any number of threads; bad input is refused by name.
// Method: rectangles with a random texture, seen by a key view and two sensor views to its left
//   and right, by casting rays; depth is known exactly.
#include "fusion/depth/depth_estimation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr uint32_t kWidth = 121, kHeight = 97;  // odd, and no multiple of a block
constexpr double kFocal = 110, kBaseline = 0.5;

// Points z = z0 + slope_x x + slope_y y with x in [left, right], in the key camera's frame, which
// is the world's.
struct Rectangle {
  double z0, slope_x = 0, slope_y = 0, left = -1e9, right = 1e9;
  uint64_t seed = 1;
};

double LatticeNoise(int64_t x, int64_t y, uint64_t seed) {
  return static_cast<double>(
             MixSeed(MixSeed(static_cast<uint64_t>(x), static_cast<uint64_t>(y)), seed) >> 40) *
         0x1.0p-24;
}

// In [0, 1]; smooth, with detail at several scales.
double Texture(double x, double y, uint64_t seed) {
  double sum = 0;
  for (int octave = 0; octave < 3; ++octave, x *= 2.3, y *= 2.3) {
    const double u = x * 6, v = y * 6, fx = u - std::floor(u), fy = v - std::floor(v);
    const int64_t i = static_cast<int64_t>(std::floor(u)), j = static_cast<int64_t>(std::floor(v));
    const auto at = [&](int64_t a, int64_t b) {
      return LatticeNoise(i + a, j + b, seed + static_cast<uint64_t>(octave));
    };
    sum += ((at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) +
            (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy) /
           3;
  }
  return sum;
}

struct Hit {
  double depth = std::numeric_limits<double>::infinity();
  double texture = 0;
};

// The ray (center_x, 0, 0) + t (x, y, 1): t is the depth.
Hit Cast(const std::vector<Rectangle>& scene, double center_x, double x, double y) {
  Hit hit;
  for (const Rectangle& r : scene) {
    const double depth = (r.z0 + r.slope_x * center_x) / (1 - r.slope_x * x - r.slope_y * y);
    const double at_x = center_x + depth * x;
    if (!(depth > 0 && depth < hit.depth) || at_x < r.left || at_x > r.right) continue;
    hit = {depth, Texture(at_x, depth * y, r.seed)};
  }
  return hit;
}

struct Exposure {
  double contrast = 200, brightness = 20;
};

View Photograph(const std::vector<Rectangle>& scene, double center_x, const Exposure& exposure = {},
                std::vector<double>* depths = nullptr) {
  View view;
  view.geometry.width_px = kWidth;
  view.geometry.height_px = kHeight;
  view.geometry.camera.fx = view.geometry.camera.fy = kFocal;
  view.geometry.camera.cx = (kWidth - 1) / 2.0;
  view.geometry.camera.cy = (kHeight - 1) / 2.0;
  view.geometry.cam_from_world.translation.x() = -center_x;
  for (uint32_t i = 0; i < kWidth * kHeight; ++i) {
    const Eigen::Vector2d n =
        view.geometry.camera.Normalize(Eigen::Vector2d(i % kWidth, i / kWidth));
    const Hit hit = Cast(scene, center_x, n.x(), n.y());
    view.gray.push_back(
        static_cast<uint8_t>(std::lround(hit.texture * exposure.contrast + exposure.brightness)));
    if (depths != nullptr) depths->push_back(hit.depth);
  }
  return view;
}

struct Shares {
  double known = 0,
         right =
             0;  // of the pixels; right: of the known ones, within a third of a px in a sensor view
};

// `skip` px at the borders do not count.
Shares Compare(const DepthMap& map, const std::vector<double>& truth, uint32_t skip = 6) {
  double count = 0, known = 0, right = 0;
  for (uint32_t y = skip; y < kHeight - skip; ++y) {
    for (uint32_t x = skip; x < kWidth - skip; ++x) {
      const double depth = map.at(x, y), expected = truth[y * kWidth + x];
      ++count;
      known += depth > 0;
      right += depth > 0 && std::abs(1 / depth - 1 / expected) * kFocal * kBaseline < 1.0 / 3;
      EXPECT_EQ(map.confidence[y * kWidth + x] > 0, depth > 0);
    }
  }
  return {known / count, right / std::max(1.0, known)};
}

const DepthRange kRange{2, 20};

struct Scene {
  explicit Scene(const std::vector<Rectangle>& scene, const Exposure& left = {},
                 const Exposure& right = {})
      : key(Photograph(scene, 0, {}, &truth)),
        sensors{Photograph(scene, -kBaseline, left), Photograph(scene, kBaseline, right)} {}

  Result<DepthMap> Estimate(const DepthOptions& options = {}, Device* device = nullptr,
                            size_t threads = 1) const {
    ThreadPool pool(threads);
    return EstimateDepth(key, sensors, kRange, options, device, pool);
  }

  std::vector<double> truth;
  View key;
  std::vector<View> sensors;
};

TEST(EstimateDepth, APlaneBeforeTheCamera) {
  const Scene scene({Rectangle{4.3}});
  const Shares shares = Compare(scene.Estimate().value(), scene.truth);
  EXPECT_GT(shares.known, 0.98);
  EXPECT_GT(shares.right, 0.98);
}

TEST(EstimateDepth, SlantedWallsAndGround) {
  for (const Rectangle& wall : {Rectangle{5, 0.9, 0}, {5, -0.9, 0}, {6, 0, -1.4}}) {
    const Scene scene({wall});
    const Shares shares = Compare(scene.Estimate().value(), scene.truth);
    EXPECT_GT(shares.known, 0.95) << wall.slope_x << " " << wall.slope_y;
    EXPECT_GT(shares.right, 0.95) << wall.slope_x << " " << wall.slope_y;
  }
}

TEST(EstimateDepth, AnotherExposureIsNoMatter) {
  const Scene scene({{5, 0.5, 0}}, {120, 90}, {150, 0});
  const Shares shares = Compare(scene.Estimate().value(), scene.truth);
  EXPECT_GT(shares.known, 0.95);
  EXPECT_GT(shares.right, 0.95);
}

// A post before a wall hides a strip of the wall from either sensor view; the other one sees it.
TEST(EstimateDepth, WhatOneSensorViewDoesNotSeeTheOtherDoes) {
  const Scene scene({{6, 0, 0, -1e9, 1e9, 1}, {3, 0, 0, -0.3, 0.3, 77}});
  const Shares both = Compare(scene.Estimate().value(), scene.truth);
  EXPECT_GT(both.known, 0.9);
  EXPECT_GT(both.right, 0.93);
  ThreadPool pool(0);
  const DepthMap one =
      EstimateDepth(scene.key, {&scene.sensors[0], 1}, kRange, {}, nullptr, pool).value();
  EXPECT_GT(both.right * both.known,
            Compare(one, scene.truth).right * Compare(one, scene.truth).known + 0.02);
}

TEST(EstimateDepth, NothingStandsOutWithoutTexture) {
  Scene scene({Rectangle{5}});
  for (View* view : {&scene.key, &scene.sensors[0], &scene.sensors[1]})
    std::fill(view->gray.begin(), view->gray.end(), 128);
  EXPECT_EQ(Compare(scene.Estimate().value(), scene.truth).known, 0);
}

void ExpectSame(const DepthMap& a, const DepthMap& b) {
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.confidence, b.confidence);
}

TEST(EstimateDepth, ThreadsDoNotMatter) {
  const Scene scene({{5, 0.7, 0}, {3, 0, 0, -0.3, 0.3, 77}});
  ExpectSame(scene.Estimate({}, nullptr, 0).value(), scene.Estimate({}, nullptr, 3).value());
}

TEST(EstimateDepth, IsCancelledAfterARequestToStop) {
  const Scene scene({{5, 0.7, 0}});
  std::stop_source asked;
  ThreadPool pool(1);
  const auto estimate = [&] {
    return EstimateDepth(scene.key, scene.sensors, kRange, {}, nullptr, pool, asked.get_token());
  };
  ExpectSame(estimate().value(), scene.Estimate().value());
  asked.request_stop();
  EXPECT_EQ(estimate().status().code(), StatusCode::kCancelled);
}

TEST(EstimateDepth, DeviceAndReferenceAgree) {
  Result<std::unique_ptr<Device>> device = Device::Open({});
  if (!device.ok()) GTEST_SKIP() << device.status().message();
  const Scene scene({{5, 0.7, 0}, {3, 0, 0, -0.3, 0.3, 77}});
  ExpectSame(scene.Estimate({}, device->get()).value(), scene.Estimate().value());
}

// Little memory: swept at half the size, refined at the whole.
TEST(EstimateDepth, ASmallVolumeServesToo) {
  const Scene scene({{5, 0.5, 0}});
  DepthOptions options;
  options.volume_bytes_max = 1 << 20;
  const Shares shares = Compare(scene.Estimate(options).value(), scene.truth);
  EXPECT_GT(shares.known, 0.95);
  EXPECT_GT(shares.right, 0.95);
}

TEST(EstimateDepth, SizesAndCamerasMayDiffer) {
  const std::vector<Rectangle> plane = {{5, 0.3, 0}};
  Scene scene(plane);
  View& wide = scene.sensors[1];
  // The right view without its first columns and rows: smaller, with another principal point.
  View part = wide;
  part.geometry.width_px = kWidth - 21;
  part.geometry.height_px = kHeight - 10;
  part.geometry.camera.cx -= 21;
  part.geometry.camera.cy -= 10;
  part.gray.clear();
  for (uint32_t y = 10; y < kHeight; ++y) {
    for (uint32_t x = 21; x < kWidth; ++x) part.gray.push_back(wide.gray[y * kWidth + x]);
  }
  wide = part;
  const Shares shares = Compare(scene.Estimate().value(), scene.truth);
  EXPECT_GT(shares.known, 0.95);
  EXPECT_GT(shares.right, 0.95);
}

TEST(EstimateDepth, RefusesBadInput) {
  const Scene good({Rectangle{5}});
  ThreadPool pool(0);
  const auto refuses = [&](const char* word, const auto& change) {
    Scene scene = good;
    DepthRange range = kRange;
    DepthOptions options;
    change(scene, range, options);
    const Status status =
        EstimateDepth(scene.key, scene.sensors, range, options, nullptr, pool).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << word;
    EXPECT_NE(status.message().find(word), std::string::npos) << status.message();
  };
  refuses("the key view has 5 gray",
          [](Scene& s, DepthRange&, DepthOptions&) { s.key.gray.resize(5); });
  refuses("the key view is 1x97",
          [](Scene& s, DepthRange&, DepthOptions&) { s.key.geometry.width_px = 1; });
  refuses("sensor view 1 is 4294967295x97", [](Scene& s, DepthRange&, DepthOptions&) {
    s.sensors[1].geometry.width_px = UINT32_MAX;
  });
  refuses("sensor view 0's camera",
          [](Scene& s, DepthRange&, DepthOptions&) { s.sensors[0].geometry.camera.fx = 0; });
  refuses("the key view's camera",
          [](Scene& s, DepthRange&, DepthOptions&) { s.key.geometry.camera.cx = std::nan(""); });
  refuses("0 sensor views", [](Scene& s, DepthRange&, DepthOptions&) { s.sensors.clear(); });
  refuses("range", [](Scene&, DepthRange& r, DepthOptions&) { r = {20, 2}; });
  refuses("range", [](Scene&, DepthRange& r, DepthOptions&) { r.near = 0; });
  refuses("range", [](Scene&, DepthRange& r, DepthOptions&) { r.far = std::nan(""); });
  refuses("sees anything", [](Scene& s, DepthRange&, DepthOptions&) {
    for (View& v : s.sensors)
      v.geometry.cam_from_world.rotation = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY());
  });
  refuses("plane_step_px", [](Scene&, DepthRange&, DepthOptions& o) { o.plane_step_px = 0; });
  refuses("plane_count_max",
          [](Scene&, DepthRange&, DepthOptions& o) { o.plane_count_max = 2000; });
  refuses("penalty_large_min",
          [](Scene&, DepthRange&, DepthOptions& o) { o.penalty_large_min = 127; });
  refuses("refinement_count", [](Scene&, DepthRange&, DepthOptions& o) { o.refinement_count = 9; });
}

TEST(EstimateDepth, TellsWhatItTakes) {
  ViewGeometry small;
  small.width_px = 512, small.height_px = 384;
  DepthOptions options;
  const uint64_t bytes = DepthVolumeBytes(small, options);
  EXPECT_GE(bytes, uint64_t{512} * 384 * options.plane_count_max);
  EXPECT_LT(bytes, options.volume_bytes_max);
  options.plane_count_max = 16;
  EXPECT_LT(DepthVolumeBytes(small, options), bytes);
  small.width_px = small.height_px = 60'000;
  EXPECT_EQ(DepthVolumeBytes(small, options), options.volume_bytes_max) << "what is allowed";
}

TEST(EstimateDepth, RefusesWhatDoesNotFit) {
  Scene scene({Rectangle{5}});
  const auto enlarge = [](View* view) {
    view->geometry.width_px = 3000;
    view->geometry.height_px = 2000;
    view->gray.assign(3000 * 2000, 7);
  };
  enlarge(&scene.key);
  DepthOptions options;
  options.volume_bytes_max = 100 << 20;
  const Status status = scene.Estimate(options).status();
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("3000x2000"), std::string::npos) << status.message();
  EXPECT_NE(status.message().find("allows 100"), std::string::npos) << status.message();
}

}  // namespace
}  // namespace veduta
