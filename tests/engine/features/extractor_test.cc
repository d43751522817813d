// SPDX-License-Identifier: Apache-2.0
// Goal: the extractor's contract at its edges: options, sizes, order, limits, descriptor norms.
// Method: small drawn images; the limited result is compared with the head of the unlimited
//   one.

#include <gtest/gtest.h>

#include <limits>
#include <tuple>

#include "engine/features/exact_math.h"
#include "engine/features/gaussian_taps.h"
#include "tests/engine/features/blob_scene.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

TEST(FeatureOptions, EveryBoundIsNoticed) {
  using Options = FeatureOptions;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  ExpectBounds<Options, uint32_t>(&Options::feature_count_max, "feature_count_max", {0, 65536},
                                  {1, 65535});
  ExpectBounds<Options, double>(&Options::contrast_threshold, "contrast_threshold", {0, 1, kNan},
                                {0.001, 0.9});
  ExpectBounds<Options, double>(&Options::edge_ratio_max, "edge_ratio_max", {1, 1001, kNan},
                                {1.1, 1000});
  ExpectBounds<Options, double>(&Options::sigma, "sigma", {1.3, 4.1, kNan}, {1.4, 4});
  ExpectBounds<Options, bool>(&Options::upsample, "upsample", {}, {false, true});
  const GrayImage image = MakeNoise(1, 32, 32);
  EXPECT_EQ(ExtractFeatures(image.View(), {.sigma = 9}).status().code(),
            StatusCode::kInvalidArgument);
}

TEST(ExtractFeatures, BadImagesAreRefused) {
  const GrayImage image = MakeNoise(1, 64, 64);
  const auto code = [](GrayView view) { return ExtractFeatures(view, {}).status().code(); };
  EXPECT_EQ(code({image.pixels.data(), 15, 64, 64}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({image.pixels.data(), 64, 15, 64}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({image.pixels.data(), 64, 64, 63}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({nullptr, 64, 64, 64}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({image.pixels.data(), -64, 64, 64}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({image.pixels.data(), 1 << 20, 1 << 20, 1 << 20}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(image.View()), StatusCode::kOk);
}

TEST(ExtractFeatures, SmallAndThinImagesWork) {
  for (const auto& [width, height] :
       {std::tuple{16, 16}, {16, 300}, {300, 16}, {17, 19}, {65, 33}}) {
    for (bool upsample : {true, false}) {
      FeatureOptions options;
      options.upsample = upsample;
      EXPECT_TRUE(ExtractFeatures(MakeNoise(width, width, height).View(), options).ok());
    }
  }
}

TEST(ExtractFeatures, NothingIsFoundInNothing) {
  for (int value : {0, 1, 127, 128, 255}) {
    GrayImage image = MakeNoise(1, 200, 150);
    std::fill(image.pixels.begin(), image.pixels.end(), static_cast<uint8_t>(value));
    FeatureOptions options;
    options.contrast_threshold = 0.001;
    const auto features = ExtractFeatures(image.View(), options);
    ASSERT_TRUE(features.ok());
    EXPECT_EQ(features->size(), 0u);
    EXPECT_TRUE(features->descriptors.empty());
  }
}

TEST(ExtractFeatures, AStraightEdgeIsNoFeature) {
  GrayImage image = MakeNoise(1, 200, 150);
  for (size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = i % 200 < 100 ? 30 : 220;
  const auto features = ExtractFeatures(image.View(), {});
  ASSERT_TRUE(features.ok());
  EXPECT_EQ(features->size(), 0u);
}

TEST(ExtractFeatures, LimitKeepsTheStrongest) {
  const GrayImage image = Draw(300, 200, 128, MakeTexture(5, 500, 300, 200));
  const auto all = ExtractFeatures(image.View(), {});
  ASSERT_TRUE(all.ok());
  ASSERT_GT(all->size(), 150u);
  for (size_t i = 1; i < all->size(); ++i)
    EXPECT_GE(all->keypoints[i - 1].response, all->keypoints[i].response);
  for (uint32_t limit : {1u, 2u, 17u, 100u, 150u}) {
    FeatureOptions options;
    options.feature_count_max = limit;
    const auto some = ExtractFeatures(image.View(), options);
    ASSERT_TRUE(some.ok());
    ASSERT_EQ(some->size(), limit);
    EXPECT_TRUE(std::equal(some->keypoints.begin(), some->keypoints.end(), all->keypoints.begin()));
    EXPECT_TRUE(
        std::equal(some->descriptors.begin(), some->descriptors.end(), all->descriptors.begin()));
  }
}

TEST(ExtractFeatures, FieldsAreInTheirRanges) {
  const GrayImage image = Draw(300, 200, 128, MakeTexture(6, 500, 300, 200));
  const auto features = ExtractFeatures(image.View(), {});
  ASSERT_TRUE(features.ok());
  ASSERT_EQ(features->descriptors.size(), features->size() * kDescriptorSize);
  int shared_places = 0;
  for (size_t i = 0; i < features->size(); ++i) {
    const Keypoint& k = features->keypoints[i];
    EXPECT_TRUE(k.x_px >= 0 && k.x_px <= 299 && k.y_px >= 0 && k.y_px <= 199);
    EXPECT_TRUE(k.angle_deg >= 0 && k.angle_deg < 360);
    EXPECT_GT(k.scale_px, 0.7);
    EXPECT_GE(k.response, 0.0133f);
    EXPECT_EQ(std::abs(k.contrast_sign), 1);
    double square = 0;
    for (int b = 0; b < kDescriptorSize; ++b)
      square += features->descriptor(i)[b] * features->descriptor(i)[b];
    EXPECT_NEAR(std::sqrt(square), 512, 8);
    if (i > 0 && features->keypoints[i - 1].x_px == k.x_px &&
        features->keypoints[i - 1].y_px == k.y_px) {
      ++shared_places;
      EXPECT_NE(features->keypoints[i - 1].angle_deg,
                k.angle_deg);  // a place twice only with another direction
    }
  }
  EXPECT_GT(shared_places, 0);
}

TEST(ExactMath, AgreesWithTheLibrary) {
  for (double v = -20; v < 20; v += 0.37) {
    EXPECT_NEAR(ExactExp2(v) / std::exp2(v), 1, 1e-13);
    EXPECT_NEAR(ExactExp(v) / std::exp(v), 1, 1e-13);
  }
  for (double v = 0; v <= 360; v += 0.7) {
    double s, c;
    ExactSinCos(v, &s, &c);
    EXPECT_NEAR(s, std::sin(v * M_PI / 180), 1e-13);
    EXPECT_NEAR(c, std::cos(v * M_PI / 180), 1e-13);
  }
}

TEST(GaussianTaps, SumToOneAndHaveTheirMoments) {
  for (double sigma : {0.7, 1.2, 1.6, 3.1, 7.7}) {
    const GaussianTaps taps = MakeGaussianTaps(sigma);
    double sum = taps.taps[0], variance = 0;
    for (int k = 1; k <= taps.radius; ++k)
      sum += 2 * taps.taps[k], variance += 2.0 * taps.taps[k] * k * k;
    EXPECT_EQ(sum, 32768);
    EXPECT_EQ(taps.taps[taps.radius + 1], 0);
    EXPECT_NEAR(std::sqrt(variance / sum), sigma, 0.004 * sigma);
    const ShiftedTaps shifted = MakeQuarterStepTaps(sigma);
    double total = 0, first = 0;
    for (int k = 0; k < shifted.count; ++k) {
      total += shifted.taps[k];
      first += shifted.taps[k] * (k - shifted.count / 2 + 0.25);
    }
    EXPECT_EQ(total, 32768);
    EXPECT_NEAR(first / total, 0, 1e-3);  // taps are rounded to 2^-15
  }
}

}  // namespace
}  // namespace veduta
