// SPDX-License-Identifier: Apache-2.0
// Goal: the scale space that is made row by row, in rings, is the one that plain loops over whole
//   images make, and the scan finds its extrema.
// Method: doubling, blurs and halving written out over whole planes with the same integer taps; all
//   extrema by comparison with 26 neighbors. Everything is compared exactly.
#include "engine/features/scale_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/features/exact_math.h"
#include "tests/engine/features/blob_scene.h"
#include "tests/engine/features/plane_of.h"

namespace veduta {
namespace {

// sum over k of taps[k] * value(k), rounded as the kernels do.
template <typename Value>
int16_t Weigh(const int16_t* taps, int count, const Value& value) {
  int32_t sum = 1 << 14;
  for (int k = 0; k < count; ++k) sum += taps[k] * value(k);
  return static_cast<int16_t>(sum >> 15);
}

// Columns, then rows; beyond the border its values are repeated.
OwnedPlane Blur(const OwnedPlane& in, double sigma) {
  const GaussianTaps half = MakeGaussianTaps(sigma);
  const int r = half.radius;
  std::vector<int16_t> taps;
  for (int k = -r; k <= r; ++k) taps.push_back(half.taps[std::abs(k)]);
  OwnedPlane between(in.width(), in.height()), out(in.width(), in.height());
  for (int y = 0; y < in.height(); ++y) {
    for (int x = 0; x < in.width(); ++x) {
      between.at(x, y) = Weigh(taps.data(), 2 * r + 1, [&](int k) {
        return in.at(x, std::clamp(y + k - r, 0, in.height() - 1));
      });
    }
  }
  for (int y = 0; y < in.height(); ++y) {
    for (int x = 0; x < in.width(); ++x) {
      out.at(x, y) = Weigh(taps.data(), 2 * r + 1, [&](int k) {
        return between.at(std::clamp(x + k - r, 0, in.width() - 1), y);
      });
    }
  }
  return out;
}

OwnedPlane Double(const OwnedPlane& photo, double sigma) {
  ShiftedTaps taps[2];  // of even and of odd rows and columns
  taps[0] = taps[1] = MakeQuarterStepTaps(std::sqrt(sigma * sigma / 4 - kPhotoSigma * kPhotoSigma));
  std::reverse(taps[1].taps, taps[1].taps + taps[1].count);
  const int count = taps[0].count, reach = count / 2;
  OwnedPlane between(photo.width(), 2 * photo.height());
  OwnedPlane out(2 * photo.width(), 2 * photo.height());
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < photo.width(); ++x) {
      between.at(x, y) = Weigh(taps[y % 2].taps, count, [&](int k) {
        return photo.at(x, std::clamp(y / 2 + k - reach, 0, photo.height() - 1));
      });
    }
    for (int x = 0; x < out.width(); ++x) {
      out.at(x, y) = Weigh(taps[x % 2].taps, count, [&](int k) {
        return between.at(std::clamp(x / 2 + k - reach, 0, photo.width() - 1), y);
      });
    }
  }
  return out;
}

OwnedPlane Halve(const OwnedPlane& in) {
  OwnedPlane out(in.width() / 2, in.height() / 2);
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) out.at(x, y) = in.at(2 * x, 2 * y);
  }
  return out;
}

using Octave = std::vector<OwnedPlane>;  // its levels

std::vector<Octave> PlainOctaves(const GrayImage& image, const FeatureOptions& options) {
  const OwnedPlane photo(image);
  OwnedPlane base =
      options.upsample
          ? Double(photo, options.sigma)
          : Blur(photo, std::sqrt(options.sigma * options.sigma - kPhotoSigma * kPhotoSigma));
  std::vector<Octave> octaves;
  while (std::min(base.width(), base.height()) >= 16) {
    Octave octave = {base};
    for (int i = 1; i < kLevels; ++i) {
      const double before = options.sigma * ExactExp2((i - 1) / 3.0);
      const double after = options.sigma * ExactExp2(i / 3.0);
      octave.push_back(Blur(octave.back(), std::sqrt(after * after - before * before)));
    }
    base = Halve(octave[kScalesPerOctave]);
    octaves.push_back(std::move(octave));
  }
  return octaves;
}

// Whether the difference of levels `level` + 1 and `level` is beyond the threshold and the extreme
// of its 27; among equals the first one is.
bool IsExtremum(const Octave& octave, int level, int x, int y, int threshold) {
  const auto difference = [&](int l, int v, int u) {
    return octave[l + 1].at(u, v) - octave[l].at(u, v);
  };
  const int here = difference(level, y, x);
  if (std::abs(here) <= threshold) return false;
  for (int k = 0; k < 27; ++k) {
    if (k == 13) continue;
    int other = difference(level + k / 9 - 1, y + k / 3 % 3 - 1, x + k % 3 - 1);
    if (here < 0) other = -other;
    if (k < 13 ? other >= std::abs(here) : other > std::abs(here)) return false;
  }
  return true;
}

std::vector<Extremum> PlainExtrema(std::vector<Octave>& octaves, const FeatureOptions& options) {
  const ExtremumLimits limits = {options.contrast_threshold / 3, options.edge_ratio_max};
  const int threshold = static_cast<int>(0.5 * limits.contrast_min * 255.0 * kGrayUnit);
  std::vector<Extremum> extrema;
  for (size_t o = 0; o < octaves.size(); ++o) {
    OctaveRows rows;
    rows.width = octaves[o][0].width();
    rows.height = octaves[o][0].height();
    for (int i = 0; i < kLevels; ++i)
      rows.levels[i] = {octaves[o][i].row(0), octaves[o][i].stride(), rows.height};
    for (int y = kExtremumBorder; y < rows.height - kExtremumBorder; ++y) {
      for (int level = 1; level <= kScalesPerOctave; ++level) {
        for (int x = kExtremumBorder; x < rows.width - kExtremumBorder; ++x) {
          if (!IsExtremum(octaves[o], level, x, y, threshold)) continue;
          if (auto extremum = RefineExtremum(rows, level, y, x, limits)) {
            extremum->octave = static_cast<int>(o);
            extrema.push_back(*extremum);
          }
        }
      }
    }
  }
  return extrema;
}

void ExpectPlain(const GrayImage& image, const FeatureOptions& options, size_t extrema_min) {
  std::vector<Octave> octaves = PlainOctaves(image, options);
  ScaleSpace made;
  std::vector<Extremum> extrema;
  made.Build(image.View(), options, BestSiftKernels(), &extrema);
  for (size_t o = 0; o < octaves.size(); ++o) {
    for (int level = 1; level <= kScalesPerOctave; ++level) {
      const GrayPlane plane = made.Plane(static_cast<int>(o), level);
      const OwnedPlane& plain = octaves[o][level];
      ASSERT_EQ(plane.width, plain.width());
      ASSERT_EQ(plane.height, plain.height());
      for (int y = 0; y < plane.height; ++y) {
        for (int x = 0; x < plane.width; ++x) {
          ASSERT_EQ(plane.pixels[y * plane.stride + x], plain.at(x, y))
              << "octave " << o << ", level " << level << ": " << x << ", " << y;
        }
      }
    }
  }
  const std::vector<Extremum> plain = PlainExtrema(octaves, options);
  EXPECT_GE(plain.size(), extrema_min);
  ASSERT_EQ(extrema.size(), plain.size());
  for (size_t i = 0; i < plain.size(); ++i) {
    const Extremum &a = extrema[i], &b = plain[i];
    EXPECT_TRUE(a.octave == b.octave && a.level == b.level && a.column == b.column &&
                a.row == b.row && a.x == b.x && a.y == b.y && a.level_offset == b.level_offset &&
                a.contrast == b.contrast)
        << "extremum " << i;
  }
}

TEST(ScaleSpace, IsThatOfWholeImages) {
  ExpectPlain(Draw(150, 117, 128, MakeTexture(1, 150, 150, 117)), {}, 50);
  FeatureOptions plain;
  plain.upsample = false;
  ExpectPlain(Draw(150, 117, 128, MakeTexture(1, 150, 150, 117)), plain, 10);
}

TEST(ScaleSpace, IsThatOfWholeImagesWithOtherOptions) {
  FeatureOptions options;
  options.sigma = 2.3;
  options.contrast_threshold = 0.01;
  ExpectPlain(MakeNoise(2, 97, 64), options, 5);
  ExpectPlain(Draw(16, 33, 128, MakeTexture(3, 10, 16, 33)), {}, 0);
}

}  // namespace
}  // namespace veduta
