// SPDX-License-Identifier: Apache-2.0
// Goal: every instruction set gives the same bytes, and so does every repetition.
// Method: whole extractions of texture, noise and extreme images, in sizes that straddle the
//   vectors' widths, compared with the portable kernels'; blurs compared with sums written out.

#include <gtest/gtest.h>

#include "engine/features/extraction.h"
#include "engine/features/gaussian_taps.h"
#include "storage/base/cpu_isa.h"
#include "tests/engine/features/blob_scene.h"

namespace veduta {
namespace {

std::vector<const SiftKernels*> AllKernels() {
  std::vector<const SiftKernels*> all;
  for (const CpuIsa isa : kCpuIsas) {
    if (const SiftKernels* kernels = FindSiftKernels(isa)) all.push_back(kernels);
  }
  return all;
}

void ExpectSame(const Features& a, const Features& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_TRUE(a.keypoints == b.keypoints);
  EXPECT_TRUE(a.descriptors == b.descriptors);
}

void ExpectKernelsAgree(const GrayImage& image, const FeatureOptions& options, size_t count_min) {
  const auto expected = ExtractFeaturesWith(*FindSiftKernels(CpuIsa::kPortable), image.View(),
                                            options, nullptr, nullptr);
  ASSERT_TRUE(expected.ok()) << expected.status().message();
  EXPECT_GE(expected->size(), count_min);
  for (const SiftKernels* kernels : AllKernels()) {
    const auto features = ExtractFeaturesWith(*kernels, image.View(), options, nullptr, nullptr);
    ASSERT_TRUE(features.ok());
    ExpectSame(*features, *expected);
  }
}

TEST(SiftKernels, AgreeOnTexture) {
  ExpectKernelsAgree(Draw(333, 257, 128, MakeTexture(1, 700, 333, 257)), {}, 200);
  FeatureOptions plain;
  plain.upsample = false;
  ExpectKernelsAgree(Draw(333, 257, 128, MakeTexture(1, 700, 333, 257)), plain, 50);
}

TEST(SiftKernels, AgreeOnAllWidths) {
  for (int width = 16; width < 90; width += 3) {
    ExpectKernelsAgree(Draw(width, 101 - width / 2, 128, MakeTexture(width, 60, width, 90)), {}, 1);
  }
}

TEST(SiftKernels, AgreeOnNoiseAndExtremes) {
  FeatureOptions options;
  options.contrast_threshold = 0.01;
  ExpectKernelsAgree(MakeNoise(3, 160, 120), options, 40);
  GrayImage board = MakeNoise(4, 200, 150);
  for (size_t i = 0; i < board.pixels.size(); ++i) {
    board.pixels[i] =
        (i % 200 / 8 + i / 200 / 8) % 2 == 0 ? 0 : 255;  // the largest steps there are
  }
  ExpectKernelsAgree(board, options, 20);
  options.sigma = 4.0;  // the widest blurs
  ExpectKernelsAgree(MakeNoise(5, 130, 140), options, 1);
}

TEST(SiftKernels, BlursAreTheSumsTheySay) {
  SeededRandom random(9);
  for (const SiftKernels* kernels : AllKernels()) {
    for (double sigma : {0.5, 1.2, 1.9, 3.1, 7.7}) {
      const GaussianTaps taps = MakeGaussianTaps(sigma);
      const int r = taps.radius, width = 2 * kRowGranule;
      std::vector<std::vector<int16_t>> rows(2 * r + kBlurRowsMax,
                                             std::vector<int16_t>(width + 2 * kRowPad + 64));
      for (auto& row : rows) {
        // Both ends of the range, and everything between.
        for (int16_t& v : row) {
          v = static_cast<int16_t>(random.Below(4) == 0   ? -16384
                                   : random.Below(4) == 0 ? 16256
                                                          : random.Below(32641) - 16384);
        }
      }
      std::vector<const int16_t*> in;
      for (const auto& row : rows) in.push_back(row.data() + kRowPad);
      std::vector<std::vector<int16_t>> made(kBlurRowsMax, std::vector<int16_t>(width));
      int16_t* out[kBlurRowsMax];
      for (int j = 0; j < kBlurRowsMax; ++j) out[j] = made[j].data();
      kernels->blur_columns(in.data(), kBlurRowsMax, taps.taps, r, out, width);
      std::vector<int16_t> along(width);
      kernels->blur_row(in[0], taps.taps, r, along.data(), width);
      for (int x = 0; x < width; ++x) {
        int32_t row_sum = 1 << 14;
        for (int k = -r; k <= r; ++k) row_sum += taps.taps[std::abs(k)] * in[0][x + k];
        ASSERT_EQ(along[x], row_sum >> 15) << sigma << " " << x;
        for (int j = 0; j < kBlurRowsMax; ++j) {
          int32_t sum = 1 << 14;
          for (int k = -r; k <= r; ++k) sum += taps.taps[std::abs(k)] * in[j + r + k][x];
          ASSERT_EQ(made[j][x], sum >> 15) << sigma << " " << x << " " << j;
        }
      }
    }
  }
}

TEST(SiftKernels, ScratchAndRepetitionChangeNothing) {
  FeatureScratch scratch;
  const GrayImage large = Draw(333, 257, 128, MakeTexture(1, 700, 333, 257));
  const GrayImage small = Draw(120, 90, 128, MakeTexture(2, 100, 120, 90));
  const auto large_alone = ExtractFeatures(large.View(), {}),
             small_alone = ExtractFeatures(small.View(), {});
  ASSERT_TRUE(large_alone.ok() && small_alone.ok());
  for (int i = 0; i < 2; ++i) {
    const auto s = ExtractFeatures(small.View(), {}, &scratch);
    const auto l = ExtractFeatures(large.View(), {}, &scratch);
    ASSERT_TRUE(s.ok() && l.ok());
    ExpectSame(*s, *small_alone);
    ExpectSame(*l, *large_alone);
  }
}

TEST(SiftKernels, StrideDoesNotMatter) {
  const GrayImage image = Draw(120, 90, 128, MakeTexture(2, 100, 120, 90));
  GrayImage wide{147, 90, std::vector<uint8_t>(147 * 90, 77)};
  for (int y = 0; y < 90; ++y) std::copy_n(&image.pixels[y * 120], 120, &wide.pixels[y * 147]);
  const auto a = ExtractFeatures(image.View(), {});
  const auto b = ExtractFeatures({wide.pixels.data(), 120, 90, 147}, {});
  ASSERT_TRUE(a.ok() && b.ok());
  ExpectSame(*a, *b);
}

}  // namespace
}  // namespace veduta
