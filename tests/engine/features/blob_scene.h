// SPDX-License-Identifier: Apache-2.0
#pragma once
// Grey images of blobs at known places, drawn analytically, for the tests of this folder.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/features/extractor.h"
#include "storage/base/content_hash.h"

namespace veduta {

struct GrayImage {
  int width = 0, height = 0;
  std::vector<uint8_t> pixels;

  GrayView View() const { return {pixels.data(), width, height, static_cast<size_t>(width)}; }
};

// A Gaussian of two widths, or a disk (radius `sigma_a`).
struct Blob {
  double x = 0, y = 0;
  double sigma_a = 1, sigma_b = 1;  // px along and across `angle_deg`
  double angle_deg = 0;
  double height = 0;  // grey levels, signed
  bool is_disk = false;
};

// Grey levels of the blob at the pixel (x, y); a disk's edge is averaged over 16 x 16 points of the
// pixel.
inline double ValueOf(const Blob& blob, int x, int y) {
  if (!blob.is_disk) {
    const double a = blob.angle_deg * M_PI / 180.0, dx = x - blob.x, dy = y - blob.y;
    const double u = (std::cos(a) * dx + std::sin(a) * dy) / blob.sigma_a;
    const double v = (-std::sin(a) * dx + std::cos(a) * dy) / blob.sigma_b;
    return blob.height * std::exp(-0.5 * (u * u + v * v));
  }
  int inside = 0;
  for (int i = 0; i < 16; ++i) {
    for (int j = 0; j < 16; ++j) {
      const double dx = x - 0.5 + (i + 0.5) / 16 - blob.x, dy = y - 0.5 + (j + 0.5) / 16 - blob.y;
      inside += dx * dx + dy * dy < blob.sigma_a * blob.sigma_a ? 1 : 0;
    }
  }
  return blob.height * inside / 256.0;
}

inline GrayImage Draw(int width, int height, double ground, const std::vector<Blob>& blobs) {
  std::vector<double> canvas(static_cast<size_t>(width) * height, ground);
  for (const Blob& blob : blobs) {
    const double reach = blob.is_disk ? blob.sigma_a + 2 : 5 * std::max(blob.sigma_a, blob.sigma_b);
    const int x0 = std::max(0, static_cast<int>(blob.x - reach)),
              x1 = std::min(width - 1, static_cast<int>(blob.x + reach));
    const int y0 = std::max(0, static_cast<int>(blob.y - reach)),
              y1 = std::min(height - 1, static_cast<int>(blob.y + reach));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x)
        canvas[static_cast<size_t>(y) * width + x] += ValueOf(blob, x, y);
    }
  }
  GrayImage image{width, height, {}};
  image.pixels.reserve(canvas.size());
  for (double v : canvas)
    image.pixels.push_back(static_cast<uint8_t>(std::clamp(v + 0.5, 0.0, 255.0)));
  return image;
}

// Blobs of all sizes and both signs, one on another: a texture whose every place looks different.
inline std::vector<Blob> MakeTexture(uint64_t seed, int count, double width, double height) {
  SeededRandom random(seed);
  std::vector<Blob> blobs;
  for (int i = 0; i < count; ++i) {
    Blob blob;
    blob.x = random.Unit() * width;
    blob.y = random.Unit() * height;
    blob.sigma_a = 1.5 * std::pow(6.0, random.Unit());
    blob.sigma_b = blob.sigma_a * (0.4 + 0.6 * random.Unit());
    blob.angle_deg = 180.0 * random.Unit();
    blob.height = (random.Unit() < 0.5 ? -1 : 1) * (20 + 40 * random.Unit());
    blobs.push_back(blob);
  }
  return blobs;
}

inline GrayImage MakeNoise(uint64_t seed, int width, int height) {
  SeededRandom random(seed);
  GrayImage image{width, height, std::vector<uint8_t>(static_cast<size_t>(width) * height)};
  for (uint8_t& v : image.pixels) v = static_cast<uint8_t>(random.Next() >> 56);
  return image;
}

}  // namespace veduta
