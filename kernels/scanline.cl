// SPDX-License-Identifier: Apache-2.0
// Scanline optimisation; kernels/scanline.h has the equations. Planes come in blocks of 16.

#define PLANES_MAX 1024
// Greater than any normalized cost can be, so that there is nothing to gain beyond the first and
// the last plane.
#define BEYOND 128

uchar least_of(uchar16 values) {
  const uchar8 eight = min(values.lo, values.hi);
  const uchar4 four = min(eight.lo, eight.hi);
  const uchar2 two = min(four.lo, four.hi);
  return min(two.x, two.y);
}

ushort least_of_sums(ushort16 values) {
  const ushort8 eight = min(values.lo, values.hi);
  const ushort4 four = min(eight.lo, eight.hi);
  const ushort2 two = min(four.lo, four.hi);
  return min(two.x, two.y);
}

// One work item for each line; the lines of one direction share no pixel. They start where
// kernels/scan_direction.h says.
//
// costs [height x width x 16 blocks], gray [height x width], penalty_large [256].
// sums [height x width x 16 blocks]: the first direction sets them, the others add to them.
kernel void run_scanlines(global const uchar* costs, global const uchar* gray,
                          constant uchar* penalty_large, uchar penalty_small, int width, int height,
                          int blocks, int dx, int dy, int is_first, global ushort* sums) {
  const int line = (int)get_global_id(0);
  const int side = dx > 0 ? 0 : width - 1, row = dy > 0 ? 0 : height - 1;
  int x, y;
  if (dy == 0) {
    x = side;
    y = line;
  } else if (dx == 0 || line < width) {
    x = line;
    y = row;
  } else {
    x = side;
    y = row + dy * (line - width + 1);
  }
  uchar before[PLANES_MAX + 32];  // normalized costs of the pixel before; plane k is at 16 + k
  uchar path[PLANES_MAX];
  for (int b = 0; b < blocks; ++b) vstore16((uchar16)(0), b, before + 16);
  before[15] = before[16 + 16 * blocks] = BEYOND;
  while (true) {
    const size_t pixel = (size_t)y * width + x;
    global const uchar* cost = costs + pixel * blocks * 16;
    global ushort* sum = sums + pixel * blocks * 16;
    uchar16 least = (uchar16)(255);
    for (int b = 0; b < blocks; ++b) {
      const uchar16 near = min(vload16(b, before + 15), vload16(b, before + 17)) + penalty_small;
      const uchar16 value = vload16(b, cost) + min(vload16(b, before + 16), near);
      vstore16(value, b, path);
      least = min(least, value);
      const ushort16 added = convert_ushort16(value);
      vstore16(is_first ? added : added + vload16(b, sum), b, sum);
    }
    x += dx;
    y += dy;
    if (x < 0 || y < 0 || x >= width || y >= height) return;
    const uchar penalty = penalty_large[abs_diff(gray[pixel], gray[(size_t)y * width + x])];
    const uchar16 lowest = (uchar16)(least_of(least));
    for (int b = 0; b < blocks; ++b)
      vstore16(min(vload16(b, path) - lowest, (uchar16)(penalty)), b, before + 16);
  }
}

// One work item for each pixel; those beyond do nothing. out [5 x pixels]: the plane, the costs
// before, at and after it, and the least cost of all other planes.
kernel void choose_planes(global const ushort* sums, int plane_count, int blocks, uint pixels,
                          global ushort* out) {
  const size_t pixel = get_global_id(0);
  if (pixel >= pixels) return;
  global const ushort* sum = sums + pixel * blocks * 16;
  const ushort16 lanes = (ushort16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const ushort16 none = (ushort16)(USHRT_MAX), count = (ushort16)((ushort)plane_count);
  ushort16 least = none;
  for (int b = 0; b < blocks; ++b) {
    const ushort16 plane = lanes + (ushort)(16 * b);
    least = min(least, select(none, vload16(b, sum), plane < count));
  }
  const ushort best_sum = least_of_sums(least);
  ushort16 first = none;
  for (int b = 0; b < blocks; ++b) {
    const ushort16 plane = lanes + (ushort)(16 * b);
    first =
        min(first, select(none, plane, vload16(b, sum) == (ushort16)(best_sum) && plane < count));
  }
  const ushort best = least_of_sums(first);
  ushort16 others = none;
  for (int b = 0; b < blocks; ++b) {
    const ushort16 plane = lanes + (ushort)(16 * b);
    const short16 is_other = plane < count && abs_diff(plane, (ushort16)(best)) > (ushort16)(1);
    others = min(others, select(none, vload16(b, sum), is_other));
  }
  out[pixel] = best;
  out[pixels + pixel] = best > 0 ? sum[best - 1] : USHRT_MAX;
  out[2 * (size_t)pixels + pixel] = best_sum;
  out[3 * (size_t)pixels + pixel] = best + 1 < plane_count ? sum[best + 1] : USHRT_MAX;
  out[4 * (size_t)pixels + pixel] = least_of_sums(others);
}
