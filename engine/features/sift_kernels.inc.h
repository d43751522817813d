// SPDX-License-Identifier: Apache-2.0
// The kernels of sift_kernels.h in terms of sift_kernels_vector.h and sift_kernels_float.h.
// Included once by each sift_kernels_*.cc; no guard.

#include "engine/features/sift_kernels.h"

namespace veduta {
namespace {

// ---- blurs ----

// Sums of products with two taps, for the low and high halves of a vector.
struct Sums {
  I16 low, high;

  void Add(I16 a, I16 b, I16 pair) {
    low = Add32(low, MulAdd(InterleaveLow(a, b), pair));
    high = Add32(high, MulAdd(InterleaveHigh(a, b), pair));
  }
};

inline I16 LoadSum(const int16_t* a, const int16_t* b) {
  return Add16(Load(a), Load(b));
}

// Several vectors at a time: the taps and row addresses are then read less often.
template <int kVectors>
inline void BlurColumnsBlock(const int16_t* const* rows, ptrdiff_t x, const int16_t* taps,
                             int radius, int16_t* out) {
  Sums sums[kVectors];
  const int16_t* p = rows[radius] + x;
  const int16_t* q = rows[radius - 1] + x;
  const int16_t* r = rows[radius + 1] + x;
  I16 pair = FillPair(taps);
  for (int i = 0; i < kVectors; ++i) {
    sums[i] = {Zero(), Zero()};
    sums[i].Add(Load(p + i * kLanes), LoadSum(q + i * kLanes, r + i * kLanes), pair);
  }
  for (int k = 2; k < radius; k += 2) {
    pair = FillPair(taps + k);
    p = rows[radius - k] + x, q = rows[radius + k] + x, r = rows[radius - k - 1] + x;
    const int16_t* s = rows[radius + k + 1] + x;
    for (int i = 0; i < kVectors; ++i) {
      const int at = i * kLanes;
      sums[i].Add(LoadSum(p + at, q + at), LoadSum(r + at, s + at), pair);
    }
  }
  if (radius % 2 == 0) {
    pair = FillPair(taps + radius);  // taps[radius + 1] is 0
    p = rows[0] + x, q = rows[2 * radius] + x;
    for (int i = 0; i < kVectors; ++i)
      sums[i].Add(LoadSum(p + i * kLanes, q + i * kLanes), Zero(), pair);
  }
  for (int i = 0; i < kVectors; ++i)
    Store(out + x + i * kLanes, PackRound(sums[i].low, sums[i].high));
}

void BlurColumns(const int16_t* const* rows, int row_count, const int16_t* taps, int radius,
                 int16_t* const* out, int width) {
  constexpr int kVectors = kLanes == 8 ? 2 : kRowGranule / kLanes;
  // All output rows of a block of columns before the next block: the inputs they share stay in the
  // first-level cache.
  for (int x = 0; x < width; x += kVectors * kLanes) {
    for (int j = 0; j < row_count; ++j)
      BlurColumnsBlock<kVectors>(rows + j, x, taps, radius, out[j]);
  }
}

void BlurRow(const int16_t* in, const int16_t* taps, int radius, int16_t* out, int width) {
  // All taps in reading order, and a zero to make their number even.
  int16_t line[2 * 64 + 2];
  for (int k = -radius; k <= radius; ++k) line[k + radius] = taps[k < 0 ? -k : k];
  line[2 * radius + 1] = 0;
  constexpr int kVectors = kLanes == 8 ? 2 : kRowGranule / kLanes;
  for (int x = 0; x < width; x += kVectors * kLanes) {
    const int16_t* p = in + x - radius;
    I16 even[kVectors], odd[kVectors];
    for (int i = 0; i < kVectors; ++i) even[i] = Zero(), odd[i] = Zero();
    for (int k = 0; k <= radius; ++k, p += 2) {
      const I16 pair = FillPair(line + 2 * k);
      for (int i = 0; i < kVectors; ++i) {
        even[i] = Add32(even[i], MulAdd(Load(p + i * kLanes), pair));
        odd[i] = Add32(odd[i], MulAdd(Load(p + i * kLanes + 1), pair));
      }
    }
    for (int i = 0; i < kVectors; ++i) Store(out + x + i * kLanes, MergeRound(even[i], odd[i]));
  }
}

void WeighRows(const int16_t* const* rows, const int16_t* taps, int tap_count, int16_t* out,
               int width) {
  for (int x = 0; x < width; x += kLanes) {
    I16 low = Zero(), high = Zero();
    for (int k = 0; k < tap_count; k += 2) {
      const int16_t weights[2] = {taps[k],
                                  static_cast<int16_t>(k + 1 < tap_count ? taps[k + 1] : 0)};
      const I16 pair = FillPair(weights);
      const I16 a = Load(rows[k] + x), b = Load(rows[k + 1 < tap_count ? k + 1 : k] + x);
      low = Add32(low, MulAdd(InterleaveLow(a, b), pair));
      high = Add32(high, MulAdd(InterleaveHigh(a, b), pair));
    }
    Store(out + x, PackRound(low, high));
  }
}

void DoubleRow(const int16_t* in, const int16_t* taps, int tap_count, int16_t* out, int width) {
  const int reach = tap_count / 2;
  for (int x = 0; x < width; x += kLanes) {
    I16 low_a = Zero(), high_a = Zero(), low_b = Zero(), high_b = Zero();
    for (int k = 0; k < tap_count; k += 2) {
      const bool whole = k + 1 < tap_count;
      const int16_t forward[2] = {taps[k], static_cast<int16_t>(whole ? taps[k + 1] : 0)};
      const int16_t backward[2] = {taps[tap_count - 1 - k],
                                   static_cast<int16_t>(whole ? taps[tap_count - 2 - k] : 0)};
      const I16 pair_a = FillPair(forward), pair_b = FillPair(backward);
      const I16 a = Load(in + x + k - reach), b = Load(in + x + k + 1 - reach);
      const I16 low = InterleaveLow(a, b), high = InterleaveHigh(a, b);
      low_a = Add32(low_a, MulAdd(low, pair_a)), high_a = Add32(high_a, MulAdd(high, pair_a));
      low_b = Add32(low_b, MulAdd(low, pair_b)), high_b = Add32(high_b, MulAdd(high, pair_b));
    }
    int16_t even[kLanes], odd[kLanes];
    Store(even, PackRound(low_a, high_a));
    Store(odd, PackRound(low_b, high_b));
    for (int i = 0; i < kLanes; ++i) {
      out[2 * (x + i)] = even[i];
      out[2 * (x + i) + 1] = odd[i];
    }
  }
}

void HalveRow(const int16_t* in, int16_t* out, int width) {
  for (int x = 0; x < width; ++x) out[x] = in[2 * x];
}

void CenterRow(const uint8_t* in, int16_t* out, int width) {
  for (int x = 0; x < width; ++x) out[x] = static_cast<int16_t>((in[x] - 128) * kGrayUnit);
}

void SubtractRow(const int16_t* a, const int16_t* b, int16_t* out, int width) {
  for (int x = 0; x < width; x += kLanes) Store(out + x, Sub16(Load(b + x), Load(a + x)));
}

// ---- extrema ----

struct Range {
  I16 low, high;
};

inline Range Spread(I16 v) {
  return {v, v};
}
inline void Widen(Range* range, I16 v) {
  range->low = Min16(range->low, v), range->high = Max16(range->high, v);
}
inline void WidenByRow(Range* range, const int16_t* p) {
  Widen(range, Load(p - 1));
  Widen(range, Load(p));
  Widen(range, Load(p + 1));
}

int FindExtrema(const int16_t* const dog[3][3], int threshold, int begin, int end,
                int32_t* columns) {
  int count = 0;
  const I16 upper = Fill(threshold), lower = Fill(-threshold);
  for (int x = begin; x < end; x += kLanes) {
    const int16_t* center = dog[1][1] + x;
    const I16 value = Load(center);
    // Neighbours that come before must be exceeded; those that come after may be equal. The six
    // nearest first: few pixels pass, and one branch for them is guessed better than one for the
    // threshold alone.
    Range before = Spread(Load(center - 1)), after = Spread(Load(center + 1));
    Widen(&before, Load(dog[1][0] + x));
    Widen(&after, Load(dog[1][2] + x));
    Widen(&before, Load(dog[0][1] + x));
    Widen(&after, Load(dog[2][1] + x));
    Mask maximum =
        AndNot(And(Greater(value, upper), Greater(value, before.high)), Greater(after.high, value));
    Mask minimum =
        AndNot(And(Greater(lower, value), Greater(before.low, value)), Greater(value, after.low));
    if (Bits(Or(maximum, minimum)) == 0) continue;
    WidenByRow(&before, dog[1][0] + x);
    WidenByRow(&after, dog[1][2] + x);
    for (int row = 0; row < 3; ++row) {
      WidenByRow(&before, dog[0][row] + x);
      WidenByRow(&after, dog[2][row] + x);
    }
    maximum = AndNot(And(maximum, Greater(value, before.high)), Greater(after.high, value));
    minimum = AndNot(And(minimum, Greater(before.low, value)), Greater(value, after.low));
    for (uint32_t bits = Bits(Or(maximum, minimum)); bits != 0; bits &= bits - 1) {
      const int column = x + (__builtin_ctz(bits) >> kLaneShift);
      if (column < end) columns[count++] = column;
    }
  }
  return count;
}

// ---- gradients ----

// Direction of (dx, dy) in eighths of a turn, [0, 8]: 0 along x, 2 along y. A polynomial for the
// arc tangent through Chebyshev nodes of [0, 1], of error below 1e-5 of an eighth; (0, 0) gives 0.
inline F8 EighthsOfTurn(F8 dx, F8 dy) {
  const F8 ax = AbsF(dx), ay = AbsF(dy);
  const F8 t = MinF(ax, ay) / MaxF(MaxF(ax, ay), FillF(1e-20f));
  const F8 s = t * t;
  const F8 odd = ((((-0.016718122f * s + 0.072052607f) * s - 0.15335990f) * s + 0.24872300f) * s -
                  0.42393416f) *
                 s;
  F8 o = t * (odd + 1.27323297f);
  o = ay > ax ? 2.0f - o : o;
  o = dx < 0.0f ? 4.0f - o : o;
  return dy < 0.0f ? 8.0f - o : o;
}

// exp(-v) for v in [0, 40): 2^-n times a polynomial on [0, 1).
inline F8 ExpOfMinus(F8 v) {
  const F8 y = v * 1.44269504f;
  const N8 n = Truncate(y);
  const F8 f = ToFloat(n) - y;  // (-1, 0]
  const F8 p = ((((0.00094687703f * f + 0.0092091804f) * f + 0.055298120f) * f + 0.24017896f) * f +
                0.69314313f) *
                   f +
               1.0f;
  return p * (F8)((127 - n) << 23);
}

// Weighted directions waiting to be counted, and the counts. Four histograms in turn: neighbouring
// pixels often share a bin, and would wait for one another. Many pixels at a time: a loop over each
// short row would often be guessed wrongly.
struct DirectionCounts {
  static constexpr int kFull = 1024;
  alignas(32) float weight[kFull + kOrientationRadiusMax * 2 + 16];
  alignas(32) int32_t bin[kFull + kOrientationRadiusMax * 2 + 16];
  int waiting = 0;
  float sums[4][kOrientationBins + 4] = {};

  void Count() {
    StoreF(weight + waiting, F8{});
    StoreN(bin + waiting, N8{});
    for (int i = 0; i < waiting; i += 4) {
      sums[0][bin[i]] += weight[i];
      sums[1][bin[i + 1]] += weight[i + 1];
      sums[2][bin[i + 2]] += weight[i + 2];
      sums[3][bin[i + 3]] += weight[i + 3];
    }
    waiting = 0;
  }
};

void OrientationHistogram(const GrayPlane& plane, float x, float y, float sigma, int radius,
                          float histogram[kOrientationBins]) {
  const int cx = static_cast<int>(x + 0.5f), cy = static_cast<int>(y + 0.5f);
  const float scale = 0.5f / (sigma * sigma);
  alignas(32) float column_weight[2 * kOrientationRadiusMax + 16],
      row_weight[2 * kOrientationRadiusMax + 16];
  constexpr N8 kIota = {0, 1, 2, 3, 4, 5, 6, 7};
  for (int i = 0; i <= 2 * radius; i += 8) {
    const F8 offset = ToFloat(kIota + (i - radius));
    const F8 u = offset - (x - static_cast<float>(cx)), v = offset - (y - static_cast<float>(cy));
    StoreF(column_weight + i, ExpOfMinus(u * u * scale));
    StoreF(row_weight + i, ExpOfMinus(v * v * scale));
  }
  DirectionCounts counts;
  const int top = cy - radius > 1 ? cy - radius : 1;
  const int bottom = cy + radius < plane.height - 2 ? cy + radius : plane.height - 2;
  int half = 0;  // half the circle's width in a row; follows the circle from row to row
  for (int row = top; row <= bottom; ++row) {
    const int dv = row - cy;
    const int room = radius * radius - dv * dv;
    while ((half + 1) * (half + 1) <= room) ++half;
    while (half * half > room) --half;
    const int begin = cx - half > 1 ? cx - half : 1;
    const int end = cx + half < plane.width - 2 ? cx + half + 1 : plane.width - 1;
    if (begin >= end) continue;
    const int16_t* p = plane.pixels + row * plane.stride;
    const float* column = column_weight + (radius - cx);
    const float row_share = row_weight[dv + radius];
    float* weight = counts.weight + counts.waiting - begin;
    int32_t* bin = counts.bin + counts.waiting - begin;
    for (int i = begin; i < end; i += 8) {  // what it writes past the end, the next row overwrites
      const F8 dx = ToFloat(WidenDifference(p + i + 1, p + i - 1));
      const F8 dy = ToFloat(WidenDifference(p + i + plane.stride, p + i - plane.stride));
      StoreF(weight + i, RootF(dx * dx + dy * dy) * (LoadF(column + i) * row_share));
      StoreN(bin + i, Truncate(EighthsOfTurn(dx, dy) * (kOrientationBins / 8.0f) + 0.5f));
    }
    counts.waiting += end - begin;
    if (counts.waiting >= DirectionCounts::kFull) counts.Count();
  }
  counts.Count();
  float(*sums)[kOrientationBins + 4] = counts.sums;
  for (int k = 0; k < 4; ++k) sums[k][0] += sums[k][kOrientationBins];  // a whole turn is none
  for (int i = 0; i < kOrientationBins; ++i) {
    histogram[i] += (sums[0][i] + sums[1][i]) + (sums[2][i] + sums[3][i]);
  }
}

// ---- descriptors ----

constexpr int kGridStride = 24;

// Grey values at column (i - 10.5), row (j - 10.5) of the rotated grid, by bilinear interpolation;
// positions outside the plane are moved to its border, where the gradient across it is then none.
inline F8 Sample(const GrayPlane& plane, F8 px, F8 py) {
  px = MinF(MaxF(px, F8{}), FillF(static_cast<float>(plane.width - 2)));
  py = MinF(MaxF(py, F8{}), FillF(static_cast<float>(plane.height - 2)));
  const N8 ix = Truncate(px), iy = Truncate(py);
  const F8 fx = px - ToFloat(ix), fy = py - ToFloat(iy);
  const int32_t stride = static_cast<int32_t>(plane.stride);
  const N8 index = iy * stride + ix;
#if defined(__AVX2__)
  // A 32-bit word holds a value (low half) and its right neighbour (high half).
  const N8 upper =
      (N8)_mm256_i32gather_epi32(reinterpret_cast<const int*>(plane.pixels), (__m256i)index, 2);
  const N8 lower = (N8)_mm256_i32gather_epi32(reinterpret_cast<const int*>(plane.pixels + stride),
                                              (__m256i)index, 2);
  const F8 a = ToFloat((upper << 16) >> 16), b = ToFloat(upper >> 16);
  const F8 c = ToFloat((lower << 16) >> 16), d = ToFloat(lower >> 16);
#else
  F8 a, b, c, d;
  for (int i = 0; i < 8; ++i) {
    const int16_t* p = plane.pixels + index[i];
    a[i] = p[0], b[i] = p[1], c[i] = p[stride], d[i] = p[stride + 1];
  }
#endif
  const F8 above = a + fx * (b - a), beneath = c + fx * (d - c);
  return above + fy * (beneath - above);
}

// Adds a row's gradients 4 kGroup .. 4 kGroup + 3 to the columns of cells they lie between: kGroup
// - 1 and kGroup.
template <int kGroup>
inline void AddGroup(const float* magnitude, const float* direction,
                     const DescriptorWeights& weights, F8 column[4]) {
  constexpr F8 kIota = {0, 1, 2, 3, 4, 5, 6, 7};
  for (int i = 4 * kGroup; i < 4 * kGroup + 4; ++i) {
    // The gradient's share in each of 8 directions: 1 at its own, falling to 0 an eighth of a turn
    // away.
    const F8 apart = AbsF(kIota - direction[i]);
    const F8 share = magnitude[i] * MaxF(1.0f - MinF(apart, 8.0f - apart), F8{});
    if constexpr (kGroup > 0) column[kGroup - 1] += weights.weight[i][kGroup - 1] * share;
    if constexpr (kGroup < 4) column[kGroup] += weights.weight[i][kGroup] * share;
  }
}

void Describe(const GrayPlane& plane, float x, float y, float step_cos, float step_sin,
              const DescriptorWeights& weights, float histogram[128]) {
  alignas(32) float grid[kGridValues * kGridStride];
  constexpr F8 kIota = {0, 1, 2, 3, 4, 5, 6, 7};
  constexpr float kMiddle = (kGridValues - 1) / 2.0f;
  for (int j = 0; j < kGridValues; ++j) {
    const float v = static_cast<float>(j) - kMiddle;
    const float row_x = x - step_sin * v, row_y = y + step_cos * v;
    for (int i = 0; i < kGridStride; i += 8) {
      const F8 u = kIota + (static_cast<float>(i) - kMiddle);
      StoreF(grid + j * kGridStride + i, Sample(plane, row_x + step_cos * u, row_y + step_sin * u));
    }
  }
  F8 cells[4][4] = {};
  alignas(32) float magnitude[kGridStride], direction[kGridStride];
  for (int j = 0; j < kGridGradients; ++j) {
    const float* p = grid + (j + 1) * kGridStride;
    for (int i = 0; i < kGridGradients; i += 8) {
      // The last block would read past the row; it is moved back and repeats some columns.
      const int at = i + 8 <= kGridGradients ? i : kGridGradients - 8;
      const F8 dx = LoadF(p + at + 2) - LoadF(p + at);
      const F8 dy = LoadF(p + at + 1 + kGridStride) - LoadF(p + at + 1 - kGridStride);
      StoreF(magnitude + at, RootF(dx * dx + dy * dy));
      StoreF(direction + at, EighthsOfTurn(dx, dy));
    }
    F8 column[4] = {};
    AddGroup<0>(magnitude, direction, weights, column);
    AddGroup<1>(magnitude, direction, weights, column);
    AddGroup<2>(magnitude, direction, weights, column);
    AddGroup<3>(magnitude, direction, weights, column);
    AddGroup<4>(magnitude, direction, weights, column);
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) cells[r][c] += weights.weight[j][r] * column[c];
    }
  }
  __builtin_memcpy(histogram, cells, sizeof(cells));
}

inline float SumLanes(F8 v) {
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

void QuantizeDescriptor(const float histogram[128], uint8_t* descriptor) {
  F8 square{};
  for (int i = 0; i < 128; i += 8) square += LoadF(histogram + i) * LoadF(histogram + i);
  // Clipping at 0.2 of the norm (Lowe 2004, section 6.1).
  const F8 limit = FillF(0.2f * __builtin_sqrtf(SumLanes(square)));
  F8 sum{};
  for (int i = 0; i < 128; i += 8) sum += MinF(LoadF(histogram + i), limit);
  const float scale = 1.0f / MaxF(FillF(SumLanes(sum)), FillF(1e-20f))[0];
  for (int i = 0; i < 128; i += 8) {
    const F8 root = RootF(MinF(LoadF(histogram + i), limit) * scale);
    const N8 byte = Truncate(MinF(root * 512.0f + 0.5f, FillF(255.0f)));
    for (int k = 0; k < 8; ++k) descriptor[i + k] = static_cast<uint8_t>(byte[k]);
  }
}

constexpr SiftKernels kTable = {BlurColumns, BlurRow,           WeighRows,
                                DoubleRow,   HalveRow,          CenterRow,
                                SubtractRow, FindExtrema,       OrientationHistogram,
                                Describe,    QuantizeDescriptor};

}  // namespace
}  // namespace veduta
