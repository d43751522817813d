// SPDX-License-Identifier: Apache-2.0
#pragma once
// The first level of the first octave, row by row from the photo.

#include "engine/features/extractor.h"
#include "engine/features/gaussian_taps.h"
#include "engine/features/scratch_memory.h"
#include "engine/features/sift_kernels.h"

namespace veduta {

// The blur that a photo is taken to have, px. Lowe takes 0.5, but doubles by linear interpolation,
// which blurs as much again; on Strecha's photos 0.25 with our sharper doubling finds as many
// features as that and places them best.
inline constexpr double kPhotoSigma = 0.25;

// Row u of the doubled image lies at y = u / 2 - 1 / 4 of the photo, columns likewise: every sample
// is a quarter px from its nearest photo pixel, so that all have the same blur. Doubling and
// blurring are one filter. Not thread-safe.
class BaseRows final {
 public:
  // Blurs to `sigma` (px of the output). `image` must stay until the last row.
  void Start(const SiftKernels& kernels, const GrayView& image, double sigma, bool upsample);

  int width() const { return upsample_ ? 2 * image_.width_px : image_.width_px; }
  int height() const { return upsample_ ? 2 * image_.height_px : image_.height_px; }
  // Writes row y, up to the granule above the width; rows in ascending order.
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
