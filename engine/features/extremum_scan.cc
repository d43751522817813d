// SPDX-License-Identifier: Apache-2.0
#include "engine/features/extremum_scan.h"

#include <algorithm>

namespace veduta {

void ExtremumScan::Start(const SiftKernels& kernels, const OctaveRows* octave, int octave_index,
                         const ExtremumLimits& limits) {
  kernels_ = &kernels;
  octave_ = octave;
  octave_index_ = octave_index;
  limits_ = limits;
  const int width = (octave->width + kRowGranule - 1) / kRowGranule * kRowGranule;
  // An odd number of cache lines, so that rows do not compete for the same sets of the cache.
  stride_ = width + 2 * kRowPad + 32;
  for (GrayBuffer& buffer : differences_) buffer.Reserve(static_cast<size_t>(kRing * stride_));
  columns_.resize(octave->width);
  next_row_ = kExtremumBorder;
  next_difference_ = kExtremumBorder - 1;
}

void ExtremumScan::ScanTo(int end, std::vector<Extremum>* extrema) {
  const OctaveRows& octave = *octave_;
  const int width = (octave.width + kRowGranule - 1) / kRowGranule * kRowGranule;
  // Half of the limit at the sample found, for the interpolated extremum may be higher. As in
  // OpenCV's SIFT.
  const int threshold = static_cast<int>(0.5 * limits_.contrast_min * 255.0 * kGrayUnit);
  end = std::min(end, octave.height - kExtremumBorder);
  for (; next_row_ < end; ++next_row_) {
    for (; next_difference_ <= next_row_ + 1; ++next_difference_) {
      for (int i = 0; i < kDifferences; ++i) {
        kernels_->subtract_row(octave.levels[i].Row(next_difference_),
                               octave.levels[i + 1].Row(next_difference_),
                               DifferenceRow(i, next_difference_), width);
      }
    }
    for (int level = 1; level <= kScalesPerOctave; ++level) {
      const int16_t* dog[3][3];
      for (int i = 0; i < 3; ++i) {
        for (int row = 0; row < 3; ++row)
          dog[i][row] = DifferenceRow(level - 1 + i, next_row_ - 1 + row);
      }
      const int count = kernels_->find_extrema(dog, threshold, kExtremumBorder,
                                               octave.width - kExtremumBorder, columns_.data());
      for (int i = 0; i < count; ++i) {
        if (auto extremum = RefineExtremum(octave, level, next_row_, columns_[i], limits_)) {
          extremum->octave = octave_index_;
          extrema->push_back(*extremum);
        }
      }
    }
  }
}

}  // namespace veduta
