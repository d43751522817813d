// SPDX-License-Identifier: Apache-2.0
// The three steps of kernels/total_variation.h, with the same operations in the same order as in
// total_variation_kernels.inc; whoever changes one changes the other. A work item is a row of 16
// voxels: global id r is row r % 256 of block r / 256, and its first voxel is 16 r.
//
// u, u_bar, p0, p1, p2  [blocks x 4096] float, with 16 floats before (so voxel v lies at 16 + v)
//                       and 16 behind them
// neighbors             [blocks x 6] int
// weights               [blocks x 8 x 4096] ushort
// centers               [blocks x 7 x 4096] uchar
// bits_of_row           [blocks x 256] uint: bit j < 8 says that bin j is not empty somewhere in
//                       the row, bit 16 + i that voxel i is observed
//
// Rows that nobody saw stay as they are. -D TAU, SIGMA: exact floats.

#define SIDE 16
#define VOXELS 4096
#define NEAR 7
#define ALL 8
#define PADDING 16
#define ENERGY_ONE 1048576.f

static float16 Min(float16 a, float16 b) {
  return select(b, a, a < b);
}
static float16 Max(float16 a, float16 b) {
  return select(b, a, a > b);
}
static float16 Abs(float16 a) {
  return Max(a, -a);
}

typedef struct {
  float16 x, y, z;
} Gradient;

// values where `lanes` has a bit, 0 elsewhere.
static float16 Keep(float16 values, uint lanes) {
  const int16 lane = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  return select((float16)(0.f), values, (((int16)((int)lanes) >> lane) & 1) != 0);
}

// Forward differences of f; 0 where the voxel or the next one is not observed.
static Gradient GradientAt(__global const float* f, __global const int* neighbors,
                           __global const uint* bits_of_row, int row) {
  const int in_block = row & 255, y = row & 15, z = in_block >> 4;
  __global const int* n = neighbors + 6 * (row >> 8);
  const float16 here = vload16(row, f);
  float16 next_x = vload16(0, f + row * SIDE + 1);
  next_x.sf = n[1] >= 0 ? f[n[1] * VOXELS + in_block * SIDE] : here.sf;
  int next_y = row + 1, next_z = row + SIDE;
  if (y == 15) next_y = n[3] >= 0 ? n[3] * 256 + z * SIDE : row;
  if (z == 15) next_z = n[5] >= 0 ? n[5] * 256 + y : row;
  const uint observed = bits_of_row[row] >> 16;
  uint next_observed = observed >> 1;
  if (n[1] >= 0) next_observed |= (bits_of_row[n[1] * 256 + in_block] >> 16 & 1) << 15;
  const uint y_observed = next_y == row ? 0 : bits_of_row[next_y] >> 16;
  const uint z_observed = next_z == row ? 0 : bits_of_row[next_z] >> 16;
  Gradient g;
  g.x = Keep(next_x - here, observed & next_observed);
  g.y = Keep(vload16(next_y, f) - here, observed & y_observed);
  g.z = Keep(vload16(next_z, f) - here, observed & z_observed);
  return g;
}

static float16 DivergenceAt(__global const float* p0, __global const float* p1,
                            __global const float* p2, __global const int* neighbors, int row) {
  const int in_block = row & 255, y = row & 15, z = in_block >> 4;
  __global const int* n = neighbors + 6 * (row >> 8);
  float16 before_x = vload16(0, p0 + row * SIDE - 1);
  before_x.s0 = n[0] >= 0 ? p0[n[0] * VOXELS + in_block * SIDE + 15] : 0.f;
  float16 before_y = (float16)(0.f), before_z = (float16)(0.f);
  if (y > 0) {
    before_y = vload16(row - 1, p1);
  } else if (n[2] >= 0) {
    before_y = vload16(n[2] * 256 + z * SIDE + 15, p1);
  }
  if (z > 0) {
    before_z = vload16(row - SIDE, p2);
  } else if (n[4] >= 0) {
    before_z = vload16(n[4] * 256 + 15 * SIDE + y, p2);
  }
  return ((vload16(row, p0) - before_x) + (vload16(row, p1) - before_y)) +
         (vload16(row, p2) - before_z);
}

// The histograms of a row.
static float16 WeightAt(__global const ushort* weights, int row, int bin) {
  return convert_float16(vload16((row >> 8) * (ALL * 256) + bin * 256 + (row & 255), weights));
}
static float16 CenterAt(__global const uchar* centers, int row, int bin) {
  if (bin == NEAR) return (float16)(1.f);
  const float step = 2.f / (7.f * 256.f);
  return (-1.f + 2.f / 7.f * (float)bin) +
         convert_float16(vload16((row >> 8) * (NEAR * 256) + bin * 256 + (row & 255), centers)) *
             step;
}
static float16 TotalAt(__global const ushort* weights, int row, uint bins) {
  float16 total = (float16)(0.f);
  for (int bin = 0; bin < ALL; ++bin) {
    if (bins >> bin & 1) total += WeightAt(weights, row, bin);
  }
  return total;
}

__kernel void DualStep(__global const float* u_bar, __global float* p0, __global float* p1,
                       __global float* p2, __global const int* neighbors,
                       __global const uint* bits_of_row, int rows) {
  const int row = get_global_id(0);
  if (row >= rows || bits_of_row[row] == 0) return;
  p0 += PADDING, p1 += PADDING, p2 += PADDING;
  const Gradient g = GradientAt(u_bar + PADDING, neighbors, bits_of_row, row);
  const float16 x = vload16(row, p0) + SIGMA * g.x;
  const float16 y = vload16(row, p1) + SIGMA * g.y;
  const float16 z = vload16(row, p2) + SIGMA * g.z;
  const float16 one = (float16)(1.f);
  const float16 scale = one / Max(sqrt((x * x + y * y) + z * z), one);
  vstore16(x * scale, row, p0);
  vstore16(y * scale, row, p1);
  vstore16(z * scale, row, p2);
}

__kernel void PrimalStep(__global float* u, __global float* u_bar, __global const float* p0,
                         __global const float* p1, __global const float* p2,
                         __global const int* neighbors, __global const ushort* weights,
                         __global const uchar* centers, __global const uint* bits_of_row,
                         float lambda, int rows) {
  const int row = get_global_id(0);
  if (row >= rows || bits_of_row[row] == 0) return;
  u += PADDING, u_bar += PADDING, p0 += PADDING, p1 += PADDING, p2 += PADDING;
  const float tau_lambda = TAU * lambda;
  const float16 before = vload16(row, u);
  const float16 v = before + TAU * DivergenceAt(p0, p1, p2, neighbors, row);
  const uint bins = bits_of_row[row];
  float16 above = TotalAt(weights, row, bins);
  float16 after = v + tau_lambda * above;
  for (int bin = 0; bin < ALL; ++bin) {
    if (!(bins >> bin & 1)) continue;
    above -= 2.f * WeightAt(weights, row, bin);
    after = Min(after, Max(CenterAt(centers, row, bin), v + tau_lambda * above));
  }
  const float16 one = (float16)(1.f);
  after = Max(Min(after, one), -one);
  vstore16(after, row, u);
  vstore16(after + (after - before), row, u_bar);
}

static long Sum(float16 row) {
  const long16 parts = convert_long16(row * ENERGY_ONE);
  const long8 a = parts.lo + parts.hi;
  const long4 b = a.lo + a.hi;
  return (b.x + b.y) + (b.z + b.w);
}

// energies [blocks x 256 x 2] long: primal and dual energy of each row, in parts of ENERGY_ONE.
__kernel void RowEnergies(__global const float* u, __global const float* p0,
                          __global const float* p1, __global const float* p2,
                          __global const int* neighbors, __global const ushort* weights,
                          __global const uchar* centers, __global const uint* bits_of_row,
                          float lambda, __global long* energies, int rows) {
  const int row = get_global_id(0);
  if (row >= rows) return;
  u += PADDING, p0 += PADDING, p1 += PADDING, p2 += PADDING;
  const Gradient g = GradientAt(u, neighbors, bits_of_row, row);
  const float16 here = vload16(row, u), q = DivergenceAt(p0, p1, p2, neighbors, row),
                one = (float16)(1.f);
  const uint bins = bits_of_row[row];
  float16 distance_sum = (float16)(0.f), at_low = (float16)(0.f),
          below = -TotalAt(weights, row, bins);
  for (int bin = 0; bin < ALL; ++bin) {
    if (!(bins >> bin & 1)) continue;
    const float16 weight = WeightAt(weights, row, bin), center = CenterAt(centers, row, bin);
    distance_sum += weight * Abs(here - center);
    at_low += weight * (center + one);
  }
  float16 value = -q - lambda * at_low, best = value, t = -one;
  for (int bin = 0; bin < ALL; ++bin) {
    if (!(bins >> bin & 1)) continue;
    const float16 center = CenterAt(centers, row, bin);
    value += (q - lambda * below) * (center - t);
    best = Max(best, value);
    t = center;
    below += 2.f * WeightAt(weights, row, bin);
  }
  value += (q - lambda * below) * (one - t);
  best = Max(best, value);
  energies[2 * row] = Sum(sqrt((g.x * g.x + g.y * g.y) + g.z * g.z)) + Sum(lambda * distance_sum);
  energies[2 * row + 1] = -Sum(best);
}
