// SPDX-License-Identifier: Apache-2.0
#pragma once
// Depth maps of a rendered street as a stereo matcher would have made them: the true depth, made
// worse.

#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/device.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"
#include "storage/model/depth_map.h"
#include "storage/model/view.h"
#include "tools/render/street/camera_rig.h"
#include "tools/render/street/scene.h"

namespace veduta::fusion_benchmark {

struct MapOptions {
  uint32_t photos = 16;  // >= 2
  double length_m = 0;   // of the street; 0: what suits the number of photos
  uint32_t width_px = 512, height_px = 384;
  double disparity_noise_px =
      0.25;  // sigma, correlated over some 3 px as windows make it, of a baseline of 1 m
  // Shares of the pixels, in blobs: those whose depth is wrong, between half and twice the true
  // one, and those that have none. Chosen by hand; not measured.
  double outlier_share = 0.05;
  double missing_share = 0.10;
  double depth_max_m = 25;  // what is farther is not known
  uint64_t seed = 1;
};

struct RenderedMap {
  ViewGeometry geometry;
  DepthMap truth;  // confidence 255 throughout
  DepthMap noisy;
  std::vector<uint8_t> gray;
};

// The scene and one map after the other. Deterministic in the options.
class RenderedStreet final {
 public:
  static Result<RenderedStreet> Make(const MapOptions& options);

  size_t count() const { return cameras_.size(); }
  Result<RenderedMap> Render(size_t i) const;
  // All maps, `noisy` by stereo of the rendered photos: two neighbours each, checked against each
  // other.
  Result<std::vector<RenderedMap>> Match(Device* device, ThreadPool& pool) const;
  const street::Scene& scene() const { return *scene_; }

 private:
  RenderedStreet() = default;
  MapOptions options_;
  std::unique_ptr<street::Scene> scene_;
  std::vector<street::StreetCamera> cameras_;
};

}  // namespace veduta::fusion_benchmark
