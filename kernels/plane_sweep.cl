// SPDX-License-Identifier: Apache-2.0
// Plane sweep. kernels/plane_sweep.h says what is computed; plane_sweep_reference.cc does the same
// in C++. Planes are swept in blocks of 16, which lie next to each other in the volume.
// -D COST_MAX, UNSEEN_COST: the constants of kernels/plane_sweep.h.

#define RADIUS_X 3
#define RADIUS_Y 2
#define GRADIENT_MAX 32
// A row has so many columns more on either side, in which its ends are repeated.
#define PAD 16

// Carries one sensor view to the key view on 16 planes. Global size (padded columns, rows, 16).
//
// geometry: rotation [9], then translation [3]. planes [padded number of planes x 3].
// base [height x width]; read only where has_base is not 0.
// warped, seen [16 x height x stride] from `offset` on: the gray level, and 255 where the sensor
// view sees the point.
kernel void warp_block(global const uchar* image, int image_width, int image_height,
                       constant float* geometry, global const float* base, int has_base,
                       global const float* planes, int first_plane, int width, int height,
                       int stride, ulong offset, global uchar* warped, global uchar* seen) {
  const int column = (int)get_global_id(0), y = (int)get_global_id(1),
            plane = (int)get_global_id(2);
  const int x = clamp(column - PAD, 0, width - 1);
  constant float* r = geometry;
  constant float* t = geometry + 9;
  const int last_x = image_width - 1, last_y = image_height - 1;
  const float limit_x = (float)last_x, limit_y = (float)last_y;
  const float xf = (float)x, yf = (float)y;
  const float rx = r[1] * yf + r[2], ry = r[4] * yf + r[5], rz = r[7] * yf + r[8];
  global const float* p3 = planes + 3 * (first_plane + plane);
  const float wy = p3[1] * yf + p3[2];
  const float w = (has_base ? base[(size_t)y * width + x] : 0.0f) + (p3[0] * xf + wy);
  const float nx = (r[0] * xf + rx) + w * t[0];
  const float ny = (r[3] * xf + ry) + w * t[1];
  const float nz = (r[6] * xf + rz) + w * t[2];
  const float scale = 1.0f / nz;
  const float u = nx * scale, v = ny * scale;
  const int is_seen = nz > 0 && u >= 0 && u <= limit_x && v >= 0 && v <= limit_y;
  // A position that is not a number becomes 0 here.
  const float cu = u > 0 ? (u < limit_x ? u : limit_x) : 0.0f;
  const float cv = v > 0 ? (v < limit_y ? v : limit_y) : 0.0f;
  const int iu = (int)(cu * 256.0f + 0.5f), iv = (int)(cv * 256.0f + 0.5f);
  const int x0 = min(iu >> 8, last_x - 1), y0 = min(iv >> 8, last_y - 1);
  const int fx = iu - (x0 << 8), fy = iv - (y0 << 8);
  global const uchar* p = image + (size_t)y0 * image_width + x0;
  const int top = p[0] * (256 - fx) + p[1] * fx;
  const int bottom = p[image_width] * (256 - fx) + p[image_width + 1] * fx;
  const size_t at = offset + ((size_t)plane * height + y) * stride + column;
  warped[at] = (uchar)((top * (256 - fy) + bottom * fy + 32768) >> 16);
  seen[at] = is_seen ? 255 : 0;
}

ushort16 load_ushort16(global const uchar* p) {
  return convert_ushort16(vload16(0, p));
}

// The cost of 16 neighboring pixels at once. `key` and `warped` point into the first rows of the
// images, at the column of the first of these pixels.
uchar16 compare(global const uchar* key, global const uchar* warped, int y, int height,
                int stride) {
  const size_t center = (size_t)y * stride;
  const uchar16 key_center = vload16(0, key + center), warped_center = vload16(0, warped + center);
  char16 different = (char16)(0);  // counts down, for true is -1
  for (int dy = -RADIUS_Y; dy <= RADIUS_Y; ++dy) {
    const size_t row = (size_t)clamp(y + dy, 0, height - 1) * stride;
    for (int dx = -RADIUS_X; dx <= RADIUS_X; ++dx) {
      // The centre itself is not darker than itself in either view, and adds nothing.
      const char16 in_key = vload16(0, key + row + dx) < key_center;
      const char16 in_warped = vload16(0, warped + row + dx) < warped_center;
      different += in_key ^ in_warped;
    }
  }
  const size_t above = (size_t)max(y - 1, 0) * stride,
               below = (size_t)min(y + 1, height - 1) * stride;
  const ushort16 across =
      abs_diff(load_ushort16(key + center + 1) + load_ushort16(warped + center - 1),
               load_ushort16(key + center - 1) + load_ushort16(warped + center + 1));
  const ushort16 down = abs_diff(load_ushort16(key + below) + load_ushort16(warped + above),
                                 load_ushort16(key + above) + load_ushort16(warped + below));
  const uchar16 gradient = convert_uchar16(min(across + down, (ushort16)(GRADIENT_MAX)));
  return (as_uchar16(-different) << (uchar16)(1)) + gradient;
}

// Costs of 16 planes at 16 neighboring pixels of a row. Global size (blocks of columns, rows).
//
// key [height x stride]; warped, seen [sensors x 16 x height x stride];
// costs [height x width x plane_stride].
kernel void cost_block(global const uchar* key, global const uchar* warped,
                       global const uchar* seen, int width, int height, int stride, int sensors,
                       global const float* planes, int first_plane, int plane_stride,
                       global uchar* costs) {
  const int x = 16 * (int)get_global_id(0), y = (int)get_global_id(1);
  uchar block[256];  // [plane][pixel]
  for (int k = 0; k < 16; ++k) {
    uchar16 best = (uchar16)(255), second = (uchar16)(255);
    for (int s = 0; s < sensors; ++s) {
      const size_t image = ((size_t)s * 16 + k) * height * stride + PAD + x;
      const uchar16 is_seen = vload16(0, seen + image + (size_t)y * stride);
      const uchar16 cost = compare(key + PAD + x, warped + image, y, height, stride) | ~is_seen;
      second = min(second, max(best, cost));
      best = min(best, cost);
    }
    // With more than two views, the mean of the best two where at least two see the point.
    const char16 is_mean = (char16)(sensors > 2 ? -1 : 0) & (second != (uchar16)(255));
    const uchar16 combined =
        select(best, (best & second) + ((best ^ second) >> (uchar16)(1)), is_mean);
    const uchar16 known = select(combined, (uchar16)(UNSEEN_COST), best == (uchar16)(255));
    // A gap, or padding.
    vstore16(isnan(planes[3 * (first_plane + k) + 2]) ? (uchar16)(COST_MAX) : known, k, block);
  }
  for (int i = 0; i < 16 && x + i < width; ++i) {
    global uchar* out = costs + ((size_t)y * width + x + i) * plane_stride + first_plane;
    for (int k = 0; k < 16; ++k) out[k] = block[16 * k + i];
  }
}
