// SPDX-License-Identifier: Apache-2.0
#pragma once
// The inner loops of SIFT, as kernels of one isa each (storage/base/cpu_isa.h). All kernels give
// the same bytes: blurs are integer arithmetic, and the floating-point loops use the same
// operations in the same order without fused rounding.
//
// Gray values are int16: (pixel - 128) * 128, so one gray level is 128 units, and the sum of any
// two values fits 16 bits. Blur taps are int16 and sum to 2^15; a blur is a convex combination
// rounded once, so it never leaves the input's range.
//
// This header is included by sources with their own -m flags: no Eigen, and no library templates
// that the linker could merge with those of other sources.

#include <cstddef>
#include <cstdint>

namespace veduta {

enum class CpuIsa : uint8_t;  // storage/base/cpu_isa.h

inline constexpr int kGrayUnit = 128;   // int16 units per gray level
inline constexpr int kRowGranule = 64;  // rows are computed in blocks of so many values
inline constexpr int kRowPad = 64;  // readable values on both sides of a row that blur_row reads
inline constexpr int kBlurRowsMax = 4;  // rows that blur_columns makes in one call
inline constexpr int kOrientationBins = 36;
inline constexpr int kOrientationRadiusMax = 60;

// The descriptor's window: 20 x 20 gradients from 22 x 22 gray values. Each spatial bin is 4
// gradients wide; interpolation between 4 bins reaches over the width of 5.
inline constexpr int kGridGradients = 20;
inline constexpr int kGridValues = kGridGradients + 2;
// A gradient's weight in the (up to two) spatial bins of its column or row, the Gaussian window
// included.
struct DescriptorWeights {
  float weight[kGridGradients][4];
};

struct GrayPlane {
  const int16_t* pixels = nullptr;  // row y at pixels + y * stride
  ptrdiff_t stride = 0;
  int width = 0, height = 0;
};

struct SiftKernels {
  // out[j][x] = sum over k of taps[|k|] * rows[j + radius + k][x], k in [-radius, radius], for
  // `row_count` (at most kBlurRowsMax) rows and x in [0, width); width is a multiple of
  // kRowGranule. `rows` has row_count + 2 radius.
  void (*blur_columns)(const int16_t* const* rows, int row_count, const int16_t* taps, int radius,
                       int16_t* const* out, int width);
  // The same sum along one row: out[x] from in[x + k]. It reads in[-radius .. width + radius], and
  // up to kRowPad values beyond, whose values do not matter.
  void (*blur_row)(const int16_t* in, const int16_t* taps, int radius, int16_t* out, int width);

  // out[x] = sum over k of taps[k] * rows[k][x], k in [0, tap_count).
  void (*weigh_rows)(const int16_t* const* rows, const int16_t* taps, int tap_count, int16_t* out,
                     int width);
  // Doubles a row: out[2x] = sum over k of taps[k] * in[x + k - tap_count / 2], and out[2x + 1] the
  // same with the taps reversed. `width` is that of `in`, a multiple of kRowGranule / 2; tap_count
  // is odd.
  void (*double_row)(const int16_t* in, const int16_t* taps, int tap_count, int16_t* out,
                     int width);
  // out[x] = in[2x] for x in [0, width).
  void (*halve_row)(const int16_t* in, int16_t* out, int width);
  // out[x] = (in[x] - 128) * 128.
  void (*center_row)(const uint8_t* in, int16_t* out, int width);
  // out[x] = b[x] - a[x].
  void (*subtract_row)(const int16_t* a, const int16_t* b, int16_t* out, int width);

  // Columns x in [begin, end) where dog[1][1][x] exceeds `threshold` in magnitude and is the
  // largest (if positive) or smallest (if negative) of its 3 x 3 x 3 neighbourhood dog[level][row].
  // Where neighbors are equal, only the first in (level, row, column) is an extremum. Writes at
  // most end - begin ascending columns and returns their number.
  int (*find_extrema)(const int16_t* const dog[3][3], int threshold, int begin, int end,
                      int32_t* columns);

  // Adds the gradients within `radius` px of (x, y) to a histogram of directions (bin i is centred
  // at 10 i degrees, from x towards y), weighted by magnitude and by a Gaussian of `sigma` px about
  // (x, y). Pixels on the plane's border and outside have no gradient. radius <=
  // kOrientationRadiusMax.
  void (*orientation_histogram)(const GrayPlane& plane, float x, float y, float sigma, int radius,
                                float histogram[kOrientationBins]);

  // The raw 4 x 4 x 8 descriptor (row, column, direction) about (x, y). Lowe takes every pixel of
  // the window and looks up its bins; here the window is resampled on a grid that turns and grows
  // with the keypoint, so that the bins and weights are the same for all keypoints, and no branch
  // is needed. With a spacing of 3 / 4 of the keypoint's scale the grid misses nothing that the
  // blur has left. step_cos, step_sin: of the keypoint's direction, times the grid's spacing in px.
  void (*describe)(const GrayPlane& plane, float x, float y, float step_cos, float step_sin,
                   const DescriptorWeights& weights, float histogram[128]);
  // Clips, takes the square root of the share in the sum, and rounds to bytes.
  void (*quantize_descriptor)(const float histogram[128], uint8_t* descriptor);
};

// The kernels written for exactly this isa; null where there are none, or the processor lacks it.
const SiftKernels* FindSiftKernels(CpuIsa isa);
// The fastest that this processor can run. Thread-safe.
const SiftKernels& BestSiftKernels();

// Each is defined in its own file; the vector ones are null off x86-64.
extern const SiftKernels* const kSiftKernelsPortable;
extern const SiftKernels* const kSiftKernelsAvx2;
extern const SiftKernels* const kSiftKernelsAvx512;

}  // namespace veduta
