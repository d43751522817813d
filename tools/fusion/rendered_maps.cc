// SPDX-License-Identifier: Apache-2.0
#include "tools/fusion/rendered_maps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fusion/depth/depth_consistency.h"
#include "fusion/depth/depth_estimation.h"
#include "storage/base/content_hash.h"

namespace veduta::fusion_benchmark {
namespace {

constexpr double kBaselineM = 1.0;
constexpr int kBlobRadiusPx = 4;

// Of mean 0 and sigma 1, averaged over 3x3 pixels and brought back to sigma 1.
std::vector<float> CorrelatedNoise(uint32_t width, uint32_t height, SeededRandom* random) {
  std::vector<float> white(static_cast<size_t>(width) * height), smooth(white.size());
  for (float& value : white) {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += random->Unit();
    value = static_cast<float>(sum);
  }
  for (int y = 0; y < static_cast<int>(height); ++y) {
    for (int x = 0; x < static_cast<int>(width); ++x) {
      float sum = 0;
      int count = 0;
      for (int v = std::max(0, y - 1); v <= std::min<int>(height - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min<int>(width - 1, x + 1); ++u, ++count) {
          sum += white[static_cast<size_t>(v) * width + u];
        }
      }
      smooth[static_cast<size_t>(y) * width + x] = sum / std::sqrt(static_cast<float>(count));
    }
  }
  return smooth;
}

// Discs over about `share` of the pixels; body(pixel, number of the disc).
template <typename Body>
void ForBlobs(const DepthMap& map, double share, SeededRandom* random, const Body& body) {
  const int width = static_cast<int>(map.width_px), height = static_cast<int>(map.height_px);
  const double disc = 3.14159 * kBlobRadiusPx * kBlobRadiusPx;
  const auto count = static_cast<int>(-std::log(1 - share) * width * height / disc);
  for (int i = 0; i < count; ++i) {
    const auto cx = static_cast<int>(random->Below(width)),
               cy = static_cast<int>(random->Below(height));
    for (int y = std::max(0, cy - kBlobRadiusPx); y <= std::min(height - 1, cy + kBlobRadiusPx);
         ++y) {
      for (int x = std::max(0, cx - kBlobRadiusPx); x <= std::min(width - 1, cx + kBlobRadiusPx);
           ++x) {
        if ((x - cx) * (x - cx) + (y - cy) * (y - cy) <= kBlobRadiusPx * kBlobRadiusPx) {
          body(static_cast<size_t>(y) * map.width_px + x, i);
        }
      }
    }
  }
}

DepthMap MakeWorse(const DepthMap& truth, double focal_px, const MapOptions& options,
                   uint64_t seed) {
  SeededRandom random(seed);
  DepthMap map = truth;
  const std::vector<float> noise = CorrelatedNoise(map.width_px, map.height_px, &random);
  const double sigma = options.disparity_noise_px / (focal_px * kBaselineM);
  for (size_t i = 0; i < map.depth.size(); ++i) {
    if (map.depth[i] <= 0) continue;
    const double inverse = 1 / map.depth[i] + sigma * noise[i];
    map.depth[i] = inverse > 1e-3 ? static_cast<float>(1 / inverse) : 0.f;
  }
  double factor = 1;
  int last = -1;
  ForBlobs(map, options.outlier_share, &random, [&](size_t pixel, int blob) {
    if (blob != last) factor = std::exp2(2 * random.Unit() - 1);
    last = blob;
    map.depth[pixel] = static_cast<float>(truth.depth[pixel] * factor);
  });
  ForBlobs(map, options.missing_share, &random, [&](size_t pixel, int) { map.depth[pixel] = 0; });
  for (size_t i = 0; i < map.depth.size(); ++i) map.confidence[i] = map.depth[i] > 0 ? 255 : 0;
  return map;
}

constexpr size_t kSensorCount = 2, kNeighborCount = 6;  // as engine/door/dense.h has them

// The nearest views that look the same way, from at least a third of a metre away.
std::vector<size_t> NearestViews(const std::vector<RenderedMap>& maps, size_t key,
                                 size_t count_max) {
  std::vector<std::pair<double, size_t>> near;
  const Rigid3& pose = maps[key].geometry.cam_from_world;
  for (size_t i = 0; i < maps.size(); ++i) {
    const Rigid3& other = maps[i].geometry.cam_from_world;
    const double distance = (other.Center() - pose.Center()).norm();
    const Eigen::Vector3d axis = pose.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d other_axis = other.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    if (i != key && distance > 0.33 && axis.dot(other_axis) > 0.9) near.push_back({distance, i});
  }
  std::sort(near.begin(), near.end());
  std::vector<size_t> views;
  for (size_t i = 0; i < std::min(count_max, near.size()); ++i) views.push_back(near[i].second);
  return views;
}

View ViewOf(const RenderedMap& map) {
  View view;
  view.geometry = map.geometry;
  view.gray = map.gray;
  return view;
}

DepthRange RangeOf(const DepthMap& truth) {
  std::vector<float> depths;
  for (const float depth : truth.depth) {
    if (depth > 0) depths.push_back(depth);
  }
  std::sort(depths.begin(), depths.end());
  if (depths.empty()) return {1, 10};
  return {depths[depths.size() / 100] / 1.2, depths[depths.size() - 1 - depths.size() / 100] * 1.2};
}

}  // namespace

Result<std::vector<RenderedMap>> RenderedStreet::Match(Device* device, ThreadPool& pool) const {
  std::vector<RenderedMap> maps;
  for (size_t i = 0; i < count(); ++i) {
    VEDUTA_ASSIGN_OR_RETURN(RenderedMap map, Render(i));
    maps.push_back(std::move(map));
  }
  std::vector<DepthMap> raw(maps.size());
  for (size_t i = 0; i < maps.size(); ++i) {
    std::vector<View> sensors;
    for (const size_t s : NearestViews(maps, i, kSensorCount)) sensors.push_back(ViewOf(maps[s]));
    if (sensors.empty())
      return Status::InvalidArgument("a view has no neighbour; take more photos");
    VEDUTA_ASSIGN_OR_RETURN(
        raw[i], EstimateDepth(ViewOf(maps[i]), sensors, RangeOf(maps[i].truth), {}, device, pool));
  }
  for (size_t i = 0; i < maps.size(); ++i) {
    std::vector<NeighborDepth> neighbors;
    for (const size_t s : NearestViews(maps, i, kNeighborCount))
      neighbors.push_back({maps[s].geometry, &raw[s]});
    VEDUTA_ASSIGN_OR_RETURN(maps[i].noisy,
                            CheckConsistency(raw[i], maps[i].geometry, neighbors, {}, pool));
    for (size_t p = 0; p < raw[i].depth.size(); ++p) {
      if (maps[i].noisy.depth[p] > options_.depth_max_m)
        maps[i].noisy.depth[p] = 0, maps[i].noisy.confidence[p] = 0;
    }
  }
  return maps;
}

Result<RenderedStreet> RenderedStreet::Make(const MapOptions& options) {
  RenderedStreet street;
  street.options_ = options;
  street::RigOptions rig;
  rig.photos = options.photos;
  rig.seed = options.seed;
  rig.model.width_px = options.width_px;
  rig.model.height_px = options.height_px;
  rig.model.fx = rig.model.fy = 0.88 * options.width_px;
  rig.model.cx = rig.model.u0 = (options.width_px - 1.0) / 2;
  rig.model.cy = rig.model.v0 = (options.height_px - 1.0) / 2;
  street::SceneOptions scene =
      street::SceneForTrajectory(rig.trajectory, options.photos, options.length_m);
  scene.seed = options.seed;
  VEDUTA_ASSIGN_OR_RETURN(street.scene_, street::BuildScene(scene));
  VEDUTA_ASSIGN_OR_RETURN(street.cameras_, street::MakeCameras(scene, rig));
  return street;
}

Result<RenderedMap> RenderedStreet::Render(size_t i) const {
  const street::StreetCamera& camera = cameras_.at(i);
  street::RenderOptions render;
  render.depth = true;
  VEDUTA_ASSIGN_OR_RETURN(street::StreetPhoto photo, street::RenderPhoto(*scene_, camera, render));
  RenderedMap map;
  map.geometry = {options_.width_px, options_.height_px, Pinhole(camera.model),
                  camera.cam_from_world};
  map.truth = {photo.width_px, photo.height_px, std::move(photo.depth), {}};
  for (float& depth : map.truth.depth) depth = depth > options_.depth_max_m ? 0.f : depth;
  for (size_t p = 0; p < photo.rgb.size(); p += 3) {
    map.gray.push_back(
        static_cast<uint8_t>((photo.rgb[p] + 2 * photo.rgb[p + 1] + photo.rgb[p + 2]) / 4));
  }
  map.truth.confidence.resize(map.truth.depth.size());
  for (size_t p = 0; p < map.truth.depth.size(); ++p)
    map.truth.confidence[p] = map.truth.depth[p] > 0 ? 255 : 0;
  map.noisy =
      MakeWorse(map.truth, map.geometry.camera.focal_px(), options_, MixSeed(options_.seed, i));
  return map;
}

}  // namespace veduta::fusion_benchmark
