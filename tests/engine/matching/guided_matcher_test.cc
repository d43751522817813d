// SPDX-License-Identifier: Apache-2.0
// Goal: matching along epipolar lines and near positions gives exactly the pairs its definition
//   names.
// Method: random scenes seen by two cameras, with clutter, twins and noise, against plain loops
//   over all pairs; then degenerate geometry and bad arguments.
#include "engine/matching/guided_matcher.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "storage/base/content_hash.h"
#include "storage/base/cpu_isa.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

struct Scene {
  Features a, b;
  Eigen::Matrix3d b_from_a;  // fundamental matrix, px
  size_t true_match_count = 0;
};

void AppendFeature(const Eigen::Vector2d& x_px, double scale_px, int8_t sign,
                   const std::vector<uint8_t>& descriptor, Features* features) {
  Keypoint keypoint;
  keypoint.x_px = static_cast<float>(x_px.x());
  keypoint.y_px = static_cast<float>(x_px.y());
  keypoint.scale_px = static_cast<float>(scale_px);
  keypoint.contrast_sign = sign;
  features->keypoints.push_back(keypoint);
  features->descriptors.insert(features->descriptors.end(), descriptor.begin(), descriptor.end());
}

std::vector<uint8_t> RandomDescriptor(SeededRandom* random) {
  std::vector<uint8_t> descriptor(kDescriptorSize);
  for (uint8_t& byte : descriptor) byte = static_cast<uint8_t>(random->Below(70));
  return descriptor;
}

std::vector<uint8_t> Noisy(std::vector<uint8_t> descriptor, SeededRandom* random) {
  for (uint8_t& byte : descriptor) byte = static_cast<uint8_t>(byte + random->Below(25));
  return descriptor;
}

Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Two cameras of 1200 px focal length, 1536 x 1024; `translation` is b's. Points seen by both, and
// clutter.
Scene RandomScene(uint32_t point_count, const Eigen::Vector3d& translation, uint64_t seed) {
  SeededRandom random(seed);
  Eigen::Matrix3d k;
  k << 1200, 0, 768, 0, 1200, 512, 0, 0, 1;
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.3, 1.0, 0.2).normalized()).toRotationMatrix();
  Scene scene;
  scene.b_from_a = k.inverse().transpose() * Skew(translation) * rotation * k.inverse();
  std::vector<uint8_t> last_descriptor = RandomDescriptor(&random);
  for (uint32_t i = 0; i < point_count; ++i) {
    const Eigen::Vector2d x_a{random.Unit() * 1535, random.Unit() * 1023};
    const double depth = 4 + random.Unit() * 20;
    const Eigen::Vector3d x_world = k.inverse() * x_a.homogeneous() * depth;
    const Eigen::Vector3d projected = k * (rotation * x_world + translation);
    const int8_t sign = random.Below(2) == 0 ? int8_t{1} : int8_t{-1};
    const double scale = 1.6 + random.Unit() * 6;
    // Every fifth looks like the one before: what a ratio test is for.
    const std::vector<uint8_t> descriptor =
        i % 5 == 4 ? Noisy(last_descriptor, &random) : RandomDescriptor(&random);
    last_descriptor = descriptor;
    AppendFeature(x_a, scale, sign, Noisy(descriptor, &random), &scene.a);
    if (projected.z() <= 0.1 || random.Below(4) == 0) {
      const Eigen::Vector2d x_b{random.Unit() * 1535, random.Unit() * 1023};
      AppendFeature(x_b, scale, sign, RandomDescriptor(&random), &scene.b);
      continue;
    }
    const Eigen::Vector2d x_b =
        projected.hnormalized() + Eigen::Vector2d{random.Unit() - 0.5, random.Unit() - 0.5} * 3;
    const double scale_b = scale * (0.6 + random.Unit());
    AppendFeature(x_b, scale_b, sign, Noisy(descriptor, &random), &scene.b);
    ++scene.true_match_count;
    // Now and then a second orientation at the same place.
    if (i % 7 == 0) AppendFeature(x_b, scale, sign, Noisy(descriptor, &random), &scene.b);
  }
  return scene;
}

uint32_t Distance(const uint8_t* a, const uint8_t* b) {
  uint32_t sum = 0;
  for (int k = 0; k < kDescriptorSize; ++k)
    sum += static_cast<uint32_t>((a[k] - b[k]) * (a[k] - b[k]));
  return sum;
}

double Apart(const Keypoint& a, const Keypoint& b) {
  return std::hypot(static_cast<double>(a.x_px) - b.x_px, static_cast<double>(a.y_px) - b.y_px);
}

bool IsCandidate(const Scene& scene, size_t i, size_t j, const GuidedMatchOptions& options) {
  const Keypoint& a = scene.a.keypoints[i];
  const Keypoint& b = scene.b.keypoints[j];
  if (a.contrast_sign != b.contrast_sign) return false;
  if (a.scale_px > b.scale_px * options.scale_ratio_max ||
      b.scale_px > a.scale_px * options.scale_ratio_max) {
    return false;
  }
  const Eigen::Vector3d x_a(a.x_px, a.y_px, 1);
  const Eigen::Vector3d x_b(b.x_px, b.y_px, 1);
  const double residual = std::abs(x_b.dot(scene.b_from_a * x_a));
  return residual / (scene.b_from_a * x_a).head<2>().norm() <= options.band_px &&
         residual / (scene.b_from_a.transpose() * x_b).head<2>().norm() <= options.band_px;
}

std::vector<DescriptorMatch> Reference(const Scene& scene, const GuidedMatchOptions& options) {
  const size_t count_a = scene.a.size();
  const size_t count_b = scene.b.size();
  std::vector<uint32_t> table(count_a * count_b, UINT32_MAX);
  for (size_t i = 0; i < count_a; ++i) {
    for (size_t j = 0; j < count_b; ++j) {
      if (IsCandidate(scene, i, j, options)) {
        table[i * count_b + j] = Distance(scene.a.descriptor(i), scene.b.descriptor(j));
      }
    }
  }
  std::vector<DescriptorMatch> matches;
  for (size_t i = 0; i < count_a; ++i) {
    const auto row = table.begin() + static_cast<ptrdiff_t>(i * count_b);
    const size_t best =
        static_cast<size_t>(std::min_element(row, row + static_cast<ptrdiff_t>(count_b)) - row);
    const uint32_t distance = row[static_cast<ptrdiff_t>(best)];
    if (distance == UINT32_MAX || distance > options.distance_squared_max) continue;
    bool mutual = true;
    for (size_t other = 0; other < count_a; ++other) {
      const uint32_t rival = table[other * count_b + best];
      if (rival < distance || (rival == distance && other < i)) mutual = false;
    }
    uint32_t second = UINT32_MAX;
    for (size_t j = 0; j < count_b; ++j) {
      if (Apart(scene.b.keypoints[j], scene.b.keypoints[best]) > options.apart_px) {
        second = std::min(second, row[static_cast<ptrdiff_t>(j)]);
      }
    }
    const bool clear = options.ratio_max >= 1 || second == UINT32_MAX ||
                       distance <= options.ratio_max * options.ratio_max * second;
    if (mutual && clear)
      matches.push_back(
          {static_cast<FeatureIndex>(i), static_cast<FeatureIndex>(best), distance, second});
  }
  return matches;
}

std::vector<DescriptorMatch> Match(const Scene& scene, const GuidedMatchOptions& options) {
  const auto matches = MatchGuided(scene.a, scene.b, FeatureGrid(scene.b), scene.b_from_a, options);
  EXPECT_TRUE(matches.ok()) << matches.status().message();
  return matches.ok() ? *matches : std::vector<DescriptorMatch>();
}

TEST(GuidedMatcher, EqualsLoopsOnRandomScenes) {
  // Sideways (level lines), upwards (steep lines), slanting, and forwards (the epipoles are inside
  // the images).
  const std::vector<Eigen::Vector3d> translations = {
      {-1, 0, 0.05}, {0.05, -1, 0}, {-0.7, 0.6, 0.1}, {0.02, 0.05, -1}};
  uint64_t seed = 1;
  for (const Eigen::Vector3d& translation : translations) {
    const Scene scene = RandomScene(700, translation, seed++);
    GuidedMatchOptions options;
    options.distance_squared_max = 60'000;
    const std::vector<DescriptorMatch> expected = Reference(scene, options);
    EXPECT_GT(expected.size(), scene.true_match_count / 3) << "the scene tests little";
    EXPECT_EQ(Match(scene, options), expected);
    options.ratio_max = 1;
    options.band_px = 20;
    options.distance_squared_max = UINT32_MAX;
    EXPECT_EQ(Match(scene, options), Reference(scene, options));
    options.scale_ratio_max = 1.3;
    options.ratio_max = 0.7;
    options.apart_px = 0;
    const std::vector<DescriptorMatch> scaled = Reference(scene, options);
    EXPECT_FALSE(scaled.empty());
    EXPECT_EQ(Match(scene, options), scaled);
  }
}

TEST(GuidedMatcher, EveryIsaGivesTheSame) {
  const Scene scene = RandomScene(1500, {-1, 0.2, 0.05}, 9);
  GuidedMatchOptions options;
  const std::vector<DescriptorMatch> expected = Match(scene, options);
  EXPECT_GT(expected.size(), 300u);
  for (const CpuIsa isa : kCpuIsas) {
    const CpuIsaLimit limit(isa);
    EXPECT_EQ(Match(scene, options), expected) << CpuIsaName(isa);
  }
}

TEST(GuidedMatcher, ScaleOfTheMatrixDoesNotMatter) {
  Scene scene = RandomScene(300, {-1, 0.2, 0.05}, 10);
  const std::vector<DescriptorMatch> expected = Match(scene, {});
  EXPECT_FALSE(expected.empty());
  const Eigen::Matrix3d matrix = scene.b_from_a;
  for (const double scale : {-1.0, 1e-200, 1e200}) {
    scene.b_from_a = matrix * scale;
    EXPECT_EQ(Match(scene, {}), expected) << scale;
  }
}

TEST(GuidedMatcher, TiesGoToTheLowestIndex) {
  Scene scene = RandomScene(60, {-1, 0, 0}, 11);
  for (Features* features : {&scene.a, &scene.b})
    std::fill(features->descriptors.begin(), features->descriptors.end(), uint8_t{9});
  GuidedMatchOptions options;
  options.ratio_max = 1;
  options.band_px = 64;
  const std::vector<DescriptorMatch> expected = Reference(scene, options);
  EXPECT_FALSE(expected.empty());
  EXPECT_EQ(Match(scene, options), expected);
}

TEST(GuidedMatcher, DegenerateMatricesMatchNothing) {
  Scene scene = RandomScene(200, {-1, 0, 0}, 12);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<Eigen::Matrix3d> matrices = {Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Constant(nan),
                                           Eigen::Matrix3d::Constant(infinity)};
  matrices.push_back(scene.b_from_a);
  matrices.back()(1, 2) = nan;
  matrices.push_back(Eigen::Matrix3d::Zero());
  matrices.back()(2, 2) = 1;  // every line is the line at infinity
  for (const Eigen::Matrix3d& matrix : matrices) {
    scene.b_from_a = matrix;
    EXPECT_TRUE(Match(scene, {}).empty()) << matrix;
  }
  EXPECT_TRUE(Match(Scene{{}, scene.b, Eigen::Matrix3d::Identity()}, {}).empty());
  EXPECT_TRUE(Match(Scene{scene.a, {}, Eigen::Matrix3d::Identity()}, {}).empty());
}

TEST(GuidedMatcher, KeypointsThatAreNotFiniteMatchNothing) {
  Scene scene = RandomScene(200, {-1, 0, 0}, 13);
  const std::vector<DescriptorMatch> before = Match(scene, {});
  ASSERT_FALSE(before.empty());
  scene.a.keypoints[before[0].a].x_px = std::numeric_limits<float>::quiet_NaN();
  for (const DescriptorMatch& match : Match(scene, {})) EXPECT_NE(match.a, before[0].a);
}

TEST(GuidedMatcher, NamesWhatIsWrong) {
  Scene scene = RandomScene(20, {-1, 0, 0}, 14);
  const auto code = [&](const GuidedMatchOptions& options) {
    return MatchGuided(scene.a, scene.b, FeatureGrid(scene.b), scene.b_from_a, options)
        .status()
        .code();
  };
  GuidedMatchOptions options;
  EXPECT_EQ(code(options), StatusCode::kOk);
  options.band_px = 1000;
  EXPECT_EQ(code(options), StatusCode::kInvalidArgument);
  Scene smaller = RandomScene(5, {-1, 0, 0}, 15);
  EXPECT_EQ(
      MatchGuided(scene.a, scene.b, FeatureGrid(smaller.b), scene.b_from_a, {}).status().code(),
      StatusCode::kInvalidArgument);
  scene.a.descriptors.pop_back();
  EXPECT_EQ(code({}), StatusCode::kInvalidArgument);
}

TEST(GuidedMatcher, EveryBoundOfItsOptionsIsNoticed) {
  using Options = GuidedMatchOptions;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ExpectBounds<Options, double>(&Options::band_px, "band_px", {-1, 0, 64.1, NAN}, {0.1, 64});
  ExpectBounds<Options, uint32_t>(&Options::distance_squared_max, "distance_squared_max", {},
                                  {0, UINT32_MAX});
  ExpectBounds<Options, double>(&Options::ratio_max, "ratio_max", {0, 1.1, NAN}, {0.1, 1});
  ExpectBounds<Options, double>(&Options::apart_px, "apart_px", {-1, NAN}, {0, 100});
  ExpectBounds<Options, double>(&Options::scale_ratio_max, "scale_ratio_max", {0.5, NAN},
                                {1, kInfinity});
}

TEST(FindNear, EqualsLoops) {
  const Scene scene = RandomScene(1500, {-1, 0.2, 0.05}, 16);
  const FeatureGrid grid(scene.b);
  GuidedScratch scratch;
  SeededRandom random(17);
  size_t found_count = 0;
  for (int i = 0; i < 500; ++i) {
    const Keypoint& around = scene.b.keypoints[random.Below(static_cast<uint32_t>(scene.b.size()))];
    NearQuery query;
    query.x_px = around.x_px + random.Unit() * 6 - 3;
    query.y_px = around.y_px + random.Unit() * 6 - 3;
    query.radius_px = random.Unit() * 60;
    query.descriptor = scene.a.descriptor(random.Below(static_cast<uint32_t>(scene.a.size())));
    query.contrast_sign = random.Below(2) == 0 ? int8_t{1} : int8_t{-1};
    query.distance_squared_max = i % 2 == 0 ? UINT32_MAX : 100'000;
    std::optional<NearFeature> expected;
    for (int pass = 0; pass < 2; ++pass) {
      for (size_t j = 0; j < scene.b.size(); ++j) {
        const Keypoint& k = scene.b.keypoints[j];
        if (k.contrast_sign != query.contrast_sign) continue;
        const double dx = k.x_px - query.x_px, dy = k.y_px - query.y_px;
        if (dx * dx + dy * dy > query.radius_px * query.radius_px) continue;
        const uint32_t distance = Distance(query.descriptor, scene.b.descriptor(j));
        if (pass == 0 && (!expected || distance < expected->distance_squared)) {
          expected = NearFeature{static_cast<FeatureIndex>(j), distance, UINT32_MAX};
        }
        if (pass == 1 && Apart(k, scene.b.keypoints[expected->feature]) > query.apart_px) {
          expected->second_distance_squared = std::min(expected->second_distance_squared, distance);
        }
      }
    }
    if (expected && expected->distance_squared > query.distance_squared_max) expected.reset();
    found_count += expected.has_value();
    ASSERT_EQ(FindNear(grid, scene.b, query, &scratch), expected) << i;
  }
  EXPECT_GT(found_count, 100u);
}

TEST(FindNear, FindsNothingWithoutAQuery) {
  const Scene scene = RandomScene(100, {-1, 0, 0}, 18);
  const FeatureGrid grid(scene.b);
  GuidedScratch scratch;
  NearQuery query;
  query.radius_px = 5000;
  query.contrast_sign = 1;
  EXPECT_FALSE(FindNear(grid, scene.b, query, &scratch).has_value());  // no descriptor
  query.descriptor = scene.a.descriptor(0);
  EXPECT_TRUE(FindNear(grid, scene.b, query, &scratch).has_value());
  ASSERT_NE(scene.a.size(), scene.b.size());
  EXPECT_FALSE(
      FindNear(grid, scene.a, query, &scratch).has_value());  // the grid is of other features
  query.contrast_sign = 0;
  EXPECT_FALSE(FindNear(grid, scene.b, query, &scratch).has_value());  // no feature without a sign
  query.contrast_sign = 1;
  query.x_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(FindNear(grid, scene.b, query, &scratch).has_value());
}

}  // namespace
}  // namespace veduta
