// SPDX-License-Identifier: Apache-2.0
#include "engine/features/scale_space.h"

#include <algorithm>
#include <cmath>

#include "engine/features/exact_math.h"

namespace veduta {
namespace {

constexpr int kOctaveSizeMin = 16;        // px: smaller octaves are not made; chosen by hand
constexpr int kBatchRows = kBlurRowsMax;  // rows of a level made at a time

int RoundUp(int value) {
  return (value + kRowGranule - 1) / kRowGranule * kRowGranule;
}

// Values from one row to the next: enough to be read beyond the width, and an odd number of cache
// lines, so that the rows of a column do not compete for the same sets of the cache.
ptrdiff_t StrideOf(int width) {
  return RoundUp(width) + kRowPad + (RoundUp(width) / 32 % 2 == 0 ? 32 : 0);
}

}  // namespace

GrayPlane ScaleSpace::Plane(int octave, int level) const {
  const OctaveRows& rows = octaves_[octave]->rows;
  return {rows.levels[level].data, rows.levels[level].stride, rows.width, rows.height};
}

void ScaleSpace::Build(const GrayView& image, const FeatureOptions& options,
                       const SiftKernels& kernels, std::vector<Extremum>* extrema) {
  kernels_ = &kernels;
  limits_ = {options.contrast_threshold / kScalesPerOctave, options.edge_ratio_max};
  for (int i = 1; i < kLevels; ++i) {
    const double before = options.sigma * ExactExp2(static_cast<double>(i - 1) / kScalesPerOctave);
    const double after = options.sigma * ExactExp2(static_cast<double>(i) / kScalesPerOctave);
    taps_[i] = MakeGaussianTaps(std::sqrt(after * after - before * before));
  }
  base_rows_.Start(kernels, image, options.sigma, options.upsample);
  int width = base_rows_.width(), height = base_rows_.height();
  for (octave_count_ = 0; std::min(width, height) >= kOctaveSizeMin;
       ++octave_count_, width /= 2, height /= 2) {
    if (static_cast<int>(octaves_.size()) == octave_count_)
      octaves_.push_back(std::make_unique<OctaveMemory>());
    octaves_[octave_count_]->rows.width = width;
    octaves_[octave_count_]->rows.height = height;
    PlaceRows(octave_count_);
  }
  for (int octave = 0; octave < octave_count_; ++octave) BuildOctave(octave, extrema);
}

// Gives every level of an octave its memory. The octaves share the rings; the first octave, which
// has the longest rows, comes first.
void ScaleSpace::PlaceRows(int octave) {
  OctaveMemory& memory = *octaves_[octave];
  OctaveRows& rows = memory.rows;
  const ptrdiff_t stride = StrideOf(rows.width);
  // How far level 0 may be ahead of the scanned row, and how far back the scan looks.
  int lag = kScanLag + kRefineReach + 2 * kBatchRows;
  for (int i = 1; i < kLevels; ++i) lag += taps_[i].radius + kBatchRows;
  for (int i = 0; i < kLevels; ++i) {
    const bool is_whole = (i == 0 && octave > 0) || (i >= 1 && i <= kScalesPerOctave);
    LevelRows& level = rows.levels[i];
    level.stride = stride;
    level.capacity = is_whole ? rows.height : std::min(rows.height, lag);
    GrayBuffer& buffer = !is_whole ? rings_[i == 0 ? 0 : i - kScalesPerOctave]
                         : i == 0  ? memory.base
                                   : memory.kept[i - 1];
    level.data = buffer.Reserve(static_cast<size_t>(level.capacity * stride + kRowPad));
  }
}

void ScaleSpace::BuildOctave(int octave, std::vector<Extremum>* extrema) {
  const OctaveRows& rows = octaves_[octave]->rows;
  const int height = rows.height;
  lines_.Reserve(static_cast<size_t>((RoundUp(rows.width) + 2 * kRowPad + 32) * kBatchRows));
  scan_.Start(*kernels_, &rows, octave, limits_);
  int made[kLevels] = {};  // rows made of each level
  if (octave > 0) made[0] = height;
  while (made[kLevels - 1] < height) {
    if (octave == 0) {
      for (int end = std::min(height, made[0] + kBatchRows); made[0] < end; ++made[0]) {
        base_rows_.Make(made[0], rows.levels[0].Row(made[0]));
      }
    }
    for (int i = 1; i < kLevels; ++i) {
      const int available = made[i - 1] == height ? height : made[i - 1] - taps_[i].radius;
      const int end = std::min(available, made[i] + kBatchRows);
      if (end <= made[i]) continue;
      BlurRows(rows, i, made[i], end);
      if (i == kScalesPerOctave && octave + 1 < octave_count_) {
        HalveRows(rows, octaves_[octave + 1]->rows, made[i], end);
      }
      made[i] = end;
    }
    scan_.ScanTo(made[kLevels - 1] == height ? height : made[kLevels - 1] - kScanLag, extrema);
  }
}

void ScaleSpace::BlurRows(const OctaveRows& octave, int level, int begin, int end) {
  const GaussianTaps& taps = taps_[level];
  const int width = RoundUp(octave.width);
  const ptrdiff_t line_stride = width + 2 * kRowPad + 32;
  const int16_t* rows[kBatchRows + 2 * kTapRadiusMax];
  const int reach = end - begin + 2 * taps.radius;
  for (int k = 0; k < reach; ++k) {
    rows[k] =
        octave.levels[level - 1].Row(std::clamp(begin - taps.radius + k, 0, octave.height - 1));
  }
  int16_t* lines[kBatchRows] = {};
  for (int j = 0; j < end - begin; ++j) lines[j] = lines_.data() + j * line_stride + kRowPad;
  kernels_->blur_columns(rows, end - begin, taps.taps, taps.radius, lines, width);
  for (int j = 0; j < end - begin; ++j) {
    ExtendRow(lines[j], octave.width);
    kernels_->blur_row(lines[j], taps.taps, taps.radius, octave.levels[level].Row(begin + j),
                       width);
  }
}

void ScaleSpace::HalveRows(const OctaveRows& octave, const OctaveRows& next, int begin, int end) {
  for (int y = (begin + 1) / 2 * 2; y < end && y / 2 < next.height; y += 2) {
    int16_t* out = next.levels[0].Row(y / 2);
    kernels_->halve_row(octave.levels[kScalesPerOctave].Row(y), out, next.width);
    std::fill_n(out + next.width, RoundUp(next.width) - next.width, out[next.width - 1]);
  }
}

}  // namespace veduta
