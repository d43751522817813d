// SPDX-License-Identifier: Apache-2.0
#include "engine/features/base_rows.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace veduta {
namespace {

int RoundUp(int value) {
  return (value + kRowGranule - 1) / kRowGranule * kRowGranule;
}

// The taps of a symmetric filter in reading order.
ShiftedTaps Unfold(const GaussianTaps& half) {
  ShiftedTaps result;
  result.count = 2 * half.radius + 1;
  for (int k = 0; k < result.count; ++k) result.taps[k] = half.taps[std::abs(k - half.radius)];
  return result;
}

}  // namespace

void ExtendRow(int16_t* row, int width) {
  std::fill_n(row - kRowPad, kRowPad, row[0]);
  std::fill_n(row + width, RoundUp(width) - width + kRowPad, row[width - 1]);
}

void BaseRows::Start(const SiftKernels& kernels, const GrayView& image, double sigma,
                     bool upsample) {
  kernels_ = &kernels;
  image_ = image;
  upsample_ = upsample;
  const double scale = upsample ? 0.5 : 1.0;  // photo px per px of the output
  const double missing = std::sqrt(sigma * sigma * scale * scale - kPhotoSigma * kPhotoSigma);
  down_ = upsample ? MakeQuarterStepTaps(missing) : Unfold(MakeGaussianTaps(missing));
  up_ = down_;
  std::reverse(up_.taps, up_.taps + up_.count);
  reach_ = down_.count / 2;
  capacity_ = down_.count + 1;
  next_source_ = 0;
  stride_ = RoundUp(image.width_px) + 32;
  source_.Reserve(static_cast<size_t>(capacity_ * stride_));
  line_.Reserve(static_cast<size_t>(RoundUp(image.width_px) + 3 * kRowPad));
}

const int16_t* BaseRows::SourceRow(int y) {
  for (; next_source_ <= y; ++next_source_) {
    int16_t* row = source_.data() + (next_source_ % capacity_) * stride_;
    kernels_->center_row(image_.pixels + static_cast<size_t>(next_source_) * image_.stride_bytes,
                         row, image_.width_px);
    std::fill_n(row + image_.width_px, RoundUp(image_.width_px) - image_.width_px,
                row[image_.width_px - 1]);
  }
  return source_.data() + (y % capacity_) * stride_;
}

void BaseRows::Make(int y, int16_t* out) {
  const int middle = upsample_ ? y / 2 : y;
  const ShiftedTaps& taps = y % 2 == 0 ? down_ : up_;
  SourceRow(std::min(middle + reach_, image_.height_px - 1));
  const int16_t* rows[2 * kTapRadiusMax + 1];
  for (int k = 0; k < taps.count; ++k)
    rows[k] = SourceRow(std::clamp(middle + k - reach_, 0, image_.height_px - 1));
  int16_t* line = line_.data() + kRowPad;
  const int width = RoundUp(image_.width_px);
  kernels_->weigh_rows(rows, taps.taps, taps.count, line, width);
  ExtendRow(line, image_.width_px);
  if (upsample_) {
    kernels_->double_row(line, down_.taps, down_.count, out, RoundUp(2 * image_.width_px) / 2);
  } else {
    kernels_->blur_row(line, down_.taps + reach_, reach_, out, width);
  }
}

}  // namespace veduta
