// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/depth_consistency.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "fusion/depth/sweep_geometry.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr uint32_t kAgreementsMax = 64;

enum class Word : uint8_t { kNothing, kAgrees, kContradicts };

// What a neighbour's depth map says about points of the key view.
class Witness final {
 public:
  Witness(const ViewGeometry& key, const NeighborDepth& neighbor, const ConsistencyOptions& options)
      : map_(*neighbor.map),
        options_(options),
        neighbor_from_key_(key, neighbor.geometry),
        key_from_neighbor_(neighbor.geometry, key) {}

  Word Say(double x, double y, double depth) const {
    // Both rays are scaled so that z is depth over the depth of the other view.
    const Eigen::Vector3d seen = depth * neighbor_from_key_.Ray(x, y, 1 / depth);
    const double depth_there = seen.z();
    if (!(depth_there > 0)) return Word::kNothing;
    const double u = std::round(seen.x() / depth_there), v = std::round(seen.y() / depth_there);
    if (!(u >= 0 && v >= 0 && u < map_.width_px && v < map_.height_px)) return Word::kNothing;
    const double measured = map_.at(static_cast<uint32_t>(u), static_cast<uint32_t>(v));
    if (!(measured > 0)) return Word::kNothing;
    const Eigen::Vector3d back = measured * key_from_neighbor_.Ray(u, v, 1 / measured);
    const Eigen::Vector2d moved = back.head<2>() / back.z() - Eigen::Vector2d(x, y);
    const bool is_near = back.z() > 0 && moved.norm() <= options_.pixel_error_max;
    if (is_near && std::abs(back.z() - depth) <= options_.depth_error_max * depth)
      return Word::kAgrees;
    return measured > depth_there * (1 + 2 * options_.depth_error_max) ? Word::kContradicts
                                                                       : Word::kNothing;
  }

 private:
  const DepthMap& map_;
  const ConsistencyOptions& options_;
  const SweepGeometry neighbor_from_key_, key_from_neighbor_;
};

Status CheckMap(const DepthMap& map, const ViewGeometry& view, const std::string& name) {
  const size_t pixels = static_cast<size_t>(view.width_px) * view.height_px;
  if (map.width_px == view.width_px && map.height_px == view.height_px &&
      map.depth.size() == pixels && map.confidence.size() == pixels) {
    return Status::Ok();
  }
  return Status::InvalidArgument(name + " has a map of " + std::to_string(map.width_px) + "x" +
                                 std::to_string(map.height_px) + " and a view of " +
                                 std::to_string(view.width_px) + "x" +
                                 std::to_string(view.height_px) + "; both must be the same");
}

}  // namespace

Status ConsistencyOptions::Check() const {
  return OptionBounds()
      .Inside("depth_error_max", depth_error_max, 0, 1)
      .AboveUpTo("pixel_error_max", pixel_error_max, 0, 100)
      .Between("agreement_count_min", agreement_count_min, 1, kAgreementsMax)
      .Between("confidence_sure", confidence_sure, 0, 255)
      .status();
}

Result<DepthMap> CheckConsistency(const DepthMap& key_map, const ViewGeometry& key,
                                  std::span<const NeighborDepth> neighbors,
                                  const ConsistencyOptions& options, ThreadPool& pool) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckMap(key_map, key, "the key view"));
  std::vector<Witness> witnesses;
  for (size_t i = 0; i < neighbors.size(); ++i) {
    const std::string name = "neighbour " + std::to_string(i);
    if (neighbors[i].map == nullptr) return Status::InvalidArgument(name + " has no map");
    VEDUTA_RETURN_IF_ERROR(CheckMap(*neighbors[i].map, neighbors[i].geometry, name));
    witnesses.emplace_back(key, neighbors[i], options);
  }
  DepthMap out = key_map;
  pool.ParallelFor(key_map.height_px, [&](size_t y) {
    for (uint32_t x = 0; x < key_map.width_px; ++x) {
      const size_t pixel = y * key_map.width_px + x;
      const float depth = key_map.depth[pixel];
      if (!(depth > 0)) continue;
      uint32_t agree = 0, contradict = 0;
      for (const Witness& witness : witnesses) {
        const Word word = witness.Say(x, static_cast<double>(y), depth);
        agree += word == Word::kAgrees;
        contradict += word == Word::kContradicts;
      }
      const bool is_sure = key_map.confidence[pixel] >= options.confidence_sure;
      if (agree >= options.agreement_count_min + (is_sure ? 0 : 1) && contradict <= agree) {
        // Each further witness halves what is missing from certainty.
        const int missing = (255 - key_map.confidence[pixel]) >> std::min(agree, 8u);
        out.confidence[pixel] = static_cast<uint8_t>(255 - missing);
      } else {
        out.depth[pixel] = 0;
        out.confidence[pixel] = 0;
      }
    }
  });
  return out;
}

}  // namespace veduta
