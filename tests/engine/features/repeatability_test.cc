// SPDX-License-Identifier: Apache-2.0
// Goal: the features of a rotated and scaled view are the same features, and their descriptors
//   find one another.
// Method: a texture of blobs is drawn, then drawn again with every blob moved by a similarity
//   (no resampling, so nothing but the extractor can lose features). Keypoints are mapped by
//   the truth; descriptors matched by brute force.

#include <gtest/gtest.h>

#include <limits>

#include "tests/engine/features/blob_scene.h"

namespace veduta {
namespace {

constexpr int kSide = 360;

struct Similarity {
  double angle_deg = 0, scale = 1, shift_x = 0, shift_y = 0;

  void Apply(double x, double y, double* u, double* v) const {
    const double a = angle_deg * M_PI / 180, mid = (kSide - 1) / 2.0;
    *u = scale * (std::cos(a) * (x - mid) - std::sin(a) * (y - mid)) + mid + shift_x;
    *v = scale * (std::sin(a) * (x - mid) + std::cos(a) * (y - mid)) + mid + shift_y;
  }
};

uint32_t Distance(const uint8_t* a, const uint8_t* b) {
  uint32_t sum = 0;
  for (int i = 0; i < kDescriptorSize; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

uint32_t Nearest(const Features& a, size_t i, const Features& b) {
  uint32_t best = 0, distance = std::numeric_limits<uint32_t>::max();
  for (uint32_t j = 0; j < b.size(); ++j) {
    if (a.keypoints[i].contrast_sign != b.keypoints[j].contrast_sign) continue;
    const uint32_t d = Distance(a.descriptor(i), b.descriptor(j));
    if (d < distance) distance = d, best = j;
  }
  return best;
}

class Repeatability : public testing::TestWithParam<Similarity> {};

TEST_P(Repeatability, MatchesAreRight) {
  const Similarity b_from_a = GetParam();
  const std::vector<Blob> blobs = MakeTexture(7, 900, kSide, kSide);
  std::vector<Blob> moved = blobs;
  for (Blob& blob : moved) {
    b_from_a.Apply(blob.x, blob.y, &blob.x, &blob.y);
    blob.sigma_a *= b_from_a.scale;
    blob.sigma_b *= b_from_a.scale;
    blob.angle_deg += b_from_a.angle_deg;
  }
  const auto a = ExtractFeatures(Draw(kSide, kSide, 128, blobs).View(), {});
  const auto b = ExtractFeatures(Draw(kSide, kSide, 128, moved).View(), {});
  ASSERT_TRUE(a.ok() && b.ok());
  int shared = 0, repeated = 0, matched = 0, right = 0, turned_right = 0;
  double distance_sum = 0;
  for (size_t i = 0; i < a->size(); ++i) {
    const Keypoint& k = a->keypoints[i];
    double u, v;
    b_from_a.Apply(k.x_px, k.y_px, &u, &v);
    const double margin = 8 * k.scale_px * std::max(1.0, b_from_a.scale);
    const auto is_inside = [margin](double x, double y) {
      return x > margin && y > margin && x < kSide - margin && y < kSide - margin;
    };
    const double scale = k.scale_px * b_from_a.scale;
    if (!is_inside(u, v) || !is_inside(k.x_px, k.y_px) || scale < 1.2) continue;
    ++shared;
    for (const Keypoint& other : b->keypoints) {
      if (std::hypot(other.x_px - u, other.y_px - v) < 0.5 * scale &&
          std::fabs(other.scale_px / scale - 1) < 0.2) {
        ++repeated;
        break;
      }
    }
    const uint32_t j = Nearest(*a, i, *b);
    if (Nearest(*b, j, *a) != i) continue;
    ++matched;
    const Keypoint& other = b->keypoints[j];
    const double error = std::hypot(other.x_px - u, other.y_px - v);
    if (error > 0.5 * scale) continue;
    ++right;
    distance_sum += error;
    const double turn = std::remainder(other.angle_deg - k.angle_deg - b_from_a.angle_deg, 360.0);
    turned_right += std::fabs(turn) < 8 ? 1 : 0;
  }
  ASSERT_GT(shared, 150);
  EXPECT_GT(repeated, 0.85 * shared);
  EXPECT_GT(matched, 0.7 * shared);
  EXPECT_GT(right, 0.93 * matched);
  EXPECT_GT(turned_right, 0.95 * right);
  EXPECT_LT(distance_sum / right, 0.15);
  RecordProperty("shared", shared);
  RecordProperty("repeated", repeated);
  RecordProperty("matched", matched);
  RecordProperty("right", right);
  RecordProperty("turned_right", turned_right);
  RecordProperty("mean_error_px", std::to_string(distance_sum / right));
}

INSTANTIATE_TEST_SUITE_P(Similarities, Repeatability,
                         testing::Values(Similarity{0, 1, 3.3, -2.7}, Similarity{90, 1, 0, 0},
                                         Similarity{37, 1, 1.5, 0.2}, Similarity{200, 1.3, 0, 0},
                                         Similarity{-15, 0.75, 5, 5}));

}  // namespace
}  // namespace veduta
