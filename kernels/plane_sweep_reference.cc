// SPDX-License-Identifier: Apache-2.0
#include "kernels/plane_sweep_reference.h"

#include <algorithm>
#include <cstdlib>

namespace veduta {
namespace {

constexpr int kRadiusX = 3, kRadiusY = 2;  // of the census window
constexpr int kGradientMax = 32;
constexpr uint32_t kBandRows = 48;  // rows of one piece of parallel work; chosen by hand

void WarpRow(const SweepProblem& problem, const SweepSensor& sensor, const SweepPlane& plane,
             uint32_t y, uint8_t* gray, uint8_t* seen) {
  const uint32_t width = problem.key.width_px;
  const float* base =
      problem.base.empty() ? nullptr : problem.base.data() + static_cast<size_t>(y) * width;
  const auto& r = sensor.rotation;
  const auto& t = sensor.translation;
  const float yf = static_cast<float>(y);
  const float rx = r[1] * yf + r[2], ry = r[4] * yf + r[5], rz = r[7] * yf + r[8];
  const float wy = plane.y * yf + plane.constant;
  const int stride = static_cast<int>(sensor.image.width_px);
  const int last_x = stride - 1, last_y = static_cast<int>(sensor.image.height_px) - 1;
  const float limit_x = static_cast<float>(last_x), limit_y = static_cast<float>(last_y);
  for (uint32_t x = 0; x < width; ++x) {
    const float xf = static_cast<float>(x);
    const float w = (base ? base[x] : 0.0f) + (plane.x * xf + wy);
    const float nx = (r[0] * xf + rx) + w * t[0];
    const float ny = (r[3] * xf + ry) + w * t[1];
    const float nz = (r[6] * xf + rz) + w * t[2];
    const float scale = 1.0f / nz;
    const float u = nx * scale, v = ny * scale;
    seen[x] = nz > 0 && u >= 0 && u <= limit_x && v >= 0 && v <= limit_y ? 255 : 0;
    // A position that is not a number becomes 0 here.
    const float cu = u > 0 ? (u < limit_x ? u : limit_x) : 0.0f;
    const float cv = v > 0 ? (v < limit_y ? v : limit_y) : 0.0f;
    const int iu = static_cast<int>(cu * 256.0f + 0.5f), iv = static_cast<int>(cv * 256.0f + 0.5f);
    const int x0 = std::min(iu >> 8, last_x - 1), y0 = std::min(iv >> 8, last_y - 1);
    const int fx = iu - (x0 << 8), fy = iv - (y0 << 8);
    const uint8_t* p = sensor.image.pixels + static_cast<size_t>(y0) * stride + x0;
    const int top = p[0] * (256 - fx) + p[1] * fx,
              bottom = p[stride] * (256 - fx) + p[stride + 1] * fx;
    gray[x] = static_cast<uint8_t>((top * (256 - fy) + bottom * fy + 32768) >> 16);
  }
}

// Rows are padded left and right by repeating their ends, so that windows need no test.
struct PaddedRows {
  PaddedRows(uint32_t width, uint32_t rows)
      : stride(width + 2 * kRadiusX), bytes(static_cast<size_t>(stride) * rows) {}
  uint8_t* row(uint32_t y) { return bytes.data() + static_cast<size_t>(y) * stride + kRadiusX; }
  void Pad(uint32_t y, uint32_t width) {
    uint8_t* pixels = row(y);
    std::fill(pixels - kRadiusX, pixels, pixels[0]);
    std::fill(pixels + width, pixels + width + kRadiusX, pixels[width - 1]);
  }
  uint32_t stride;
  std::vector<uint8_t> bytes;
};

// The cost of a row: how many neighbours are on different sides of their centre in the two views,
// and how far the gradients are apart. The row pointers go from kRadiusY rows above it to kRadiusY
// rows below.
void CompareRow(const uint8_t* const* key_rows, const uint8_t* const* warped_rows, uint32_t width,
                uint8_t* cost) {
  const uint8_t* __restrict key = key_rows[kRadiusY];
  const uint8_t* __restrict warped = warped_rows[kRadiusY];
  uint8_t* __restrict out = cost;
  std::fill_n(out, width, uint8_t{0});
  for (int dy = -kRadiusY; dy <= kRadiusY; ++dy) {
    for (int dx = -kRadiusX; dx <= kRadiusX; ++dx) {
      const uint8_t* __restrict a = key_rows[kRadiusY + dy] + dx;
      const uint8_t* __restrict b = warped_rows[kRadiusY + dy] + dx;
      for (uint32_t x = 0; x < width; ++x) {
        out[x] = static_cast<uint8_t>(out[x] + ((a[x] < key[x]) != (b[x] < warped[x])));
      }
    }
  }
  const uint8_t* __restrict key_above = key_rows[kRadiusY - 1];
  const uint8_t* __restrict key_below = key_rows[kRadiusY + 1];
  const uint8_t* __restrict warped_above = warped_rows[kRadiusY - 1];
  const uint8_t* __restrict warped_below = warped_rows[kRadiusY + 1];
  const uint8_t *key_left = key - 1, *key_right = key + 1, *warped_left = warped - 1,
                *warped_right = warped + 1;
  for (uint32_t x = 0; x < width; ++x) {
    const int across = std::abs((key_right[x] - key_left[x]) - (warped_right[x] - warped_left[x]));
    const int down = std::abs((key_below[x] - key_above[x]) - (warped_below[x] - warped_above[x]));
    out[x] = static_cast<uint8_t>(2 * out[x] + std::min(across + down, kGradientMax));
  }
}

// The costs of the best two views so far; UINT8_MAX where there is no view.
struct BestCosts {
  std::vector<uint8_t> first, second;
};

void AddView(const uint8_t* cost, const uint8_t* seen, uint32_t width, BestCosts* best) {
  uint8_t* __restrict first = best->first.data();
  uint8_t* __restrict second = best->second.data();
  for (uint32_t x = 0; x < width; ++x) {
    const uint8_t c = static_cast<uint8_t>(cost[x] | static_cast<uint8_t>(~seen[x]));
    second[x] = std::min(second[x], std::max(first[x], c));
    first[x] = std::min(first[x], c);
  }
}

// The better cost of up to two views, or the mean of the best two of more views.
uint8_t CombineCosts(uint8_t first, uint8_t second, bool many) {
  if (first == UINT8_MAX) return kUnseenCost;
  return many && second != UINT8_MAX ? static_cast<uint8_t>((first + second) / 2) : first;
}

class BandSweeper final {
 public:
  BandSweeper(const SweepProblem& problem, CostVolume* volume, uint32_t begin, uint32_t end)
      : problem_(problem),
        volume_(volume),
        begin_(begin),
        end_(end),
        width_(problem.key.width_px),
        halo_begin_(begin < kRadiusY ? 0 : begin - kRadiusY),
        halo_end_(std::min(end + kRadiusY, problem.key.height_px)),
        key_(width_, halo_end_ - halo_begin_),
        warped_(problem.sensors.size(), PaddedRows(width_, halo_end_ - halo_begin_)),
        seen_(problem.sensors.size(),
              std::vector<uint8_t>(static_cast<size_t>(width_) * (halo_end_ - halo_begin_))),
        cost_(width_),
        best_{std::vector<uint8_t>(width_), std::vector<uint8_t>(width_)} {
    for (uint32_t y = halo_begin_; y < halo_end_; ++y) {
      std::copy_n(problem.key.pixels + static_cast<size_t>(y) * width_, width_,
                  key_.row(y - halo_begin_));
      key_.Pad(y - halo_begin_, width_);
    }
  }

  // Leaves costs unwritten after a stop request.
  void Sweep(const std::stop_token& stop) {
    for (uint32_t plane = 0; plane < problem_.planes.size() && !stop.stop_requested(); ++plane) {
      if (problem_.planes[plane].is_gap()) continue;
      Warp(problem_.planes[plane]);
      for (uint32_t y = begin_; y < end_; ++y) Compare(plane, y);
    }
  }

 private:
  void Warp(const SweepPlane& plane) {
    for (size_t s = 0; s < warped_.size(); ++s) {
      for (uint32_t y = halo_begin_; y < halo_end_; ++y) {
        const uint32_t row = y - halo_begin_;
        WarpRow(problem_, problem_.sensors[s], plane, y, warped_[s].row(row),
                seen_[s].data() + size_t{row} * width_);
        warped_[s].Pad(row, width_);
      }
    }
  }

  void Compare(uint32_t plane, uint32_t y) {
    std::fill(best_.first.begin(), best_.first.end(), UINT8_MAX);
    std::fill(best_.second.begin(), best_.second.end(), UINT8_MAX);
    for (size_t s = 0; s < warped_.size(); ++s) {
      const uint8_t* key_rows[2 * kRadiusY + 1];
      const uint8_t* warped_rows[2 * kRadiusY + 1];
      for (int dy = -kRadiusY; dy <= kRadiusY; ++dy) {
        const int near =
            std::clamp(static_cast<int>(y) + dy, 0, static_cast<int>(problem_.key.height_px) - 1);
        const uint32_t row = static_cast<uint32_t>(near) - halo_begin_;
        key_rows[dy + kRadiusY] = key_.row(row);
        warped_rows[dy + kRadiusY] = warped_[s].row(row);
      }
      CompareRow(key_rows, warped_rows, width_, cost_.data());
      AddView(cost_.data(), seen_[s].data() + static_cast<size_t>(y - halo_begin_) * width_, width_,
              &best_);
    }
    const bool many = warped_.size() > 2;
    uint8_t* out =
        volume_->costs.data() + static_cast<size_t>(y) * width_ * volume_->plane_stride + plane;
    for (uint32_t x = 0; x < width_; ++x) {
      out[static_cast<size_t>(x) * volume_->plane_stride] =
          CombineCosts(best_.first[x], best_.second[x], many);
    }
  }

  const SweepProblem& problem_;
  CostVolume* volume_;
  const uint32_t begin_, end_, width_, halo_begin_, halo_end_;
  PaddedRows key_;
  std::vector<PaddedRows> warped_;
  std::vector<std::vector<uint8_t>> seen_;
  std::vector<uint8_t> cost_;
  BestCosts best_;
};

}  // namespace

Status SweepPlanesReference(const SweepProblem& problem, ThreadPool& pool,
                            const std::stop_token& stop, CostVolume* volume) {
  const uint32_t height = problem.key.height_px;
  pool.ParallelFor((height + kBandRows - 1) / kBandRows, [&](size_t band) {
    if (stop.stop_requested()) return;
    const uint32_t begin = static_cast<uint32_t>(band) * kBandRows;
    BandSweeper(problem, volume, begin, std::min(begin + kBandRows, height)).Sweep(stop);
  });
  return stop.stop_requested() ? Status::Cancelled("the plane sweep was stopped on request")
                               : Status::Ok();
}

}  // namespace veduta
