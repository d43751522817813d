// SPDX-License-Identifier: Apache-2.0
#pragma once
// The first level of the first octave, row by row from the photo.

#include "engine/features/feature_options.h"
#include "engine/features/gaussian_taps.h"
#include "engine/features/scratch_memory.h"
#include "engine/features/sift_kernels.h"

namespace veduta {

// The blur that a photo is taken to have, in px. Lowe 2004, section 3.3, takes 0.5 and doubles by
// linear interpolation, which blurs as much again. Our doubling is sharper: on Strecha's photos
// (fountain-P11, castle-P19) it finds as many features with 0.25 and places them best.
inline constexpr double kPhotoSigma = 0.25;

// Row u of the doubled image lies at y = u / 2 - 1 / 4 of the photo, and column u at x = u / 2 -
// 1 / 4: every sample is a quarter px from its nearest photo pixel, so that all samples have the
// same blur. Doubling and blurring are one filter. Not thread-safe.
class BaseRows final {
 public:
  // Prepares to blur to `sigma` (px of the output). `image` must live until the last row is made.
  void Start(const SiftKernels& kernels, const GrayView& image, double sigma, bool upsample);

  int width() const { return upsample_ ? 2 * image_.width_px : image_.width_px; }
  int height() const { return upsample_ ? 2 * image_.height_px : image_.height_px; }
  // Writes row y, its width rounded up to a multiple of kRowGranule. Ask for rows in ascending
  // order.
  void Make(int y, int16_t* out);

 private:
  const int16_t* SourceRow(int y);

  const SiftKernels* kernels_ = nullptr;
  GrayView image_;
  bool upsample_ = false;
  ShiftedTaps down_,
      up_;  // of a row before and after its nearest source row; `down_` alone without doubling
  int reach_ = 0;
  int capacity_ = 0, next_source_ = 0;
  ptrdiff_t stride_ = 0;
  GrayBuffer source_;  // a ring of centred photo rows
  GrayBuffer line_;    // one row between the two passes
};

// Repeats the first and last of row[0 .. width) outwards, as far as blur_row reads.
void ExtendRow(int16_t* row, int width);

}  // namespace veduta
