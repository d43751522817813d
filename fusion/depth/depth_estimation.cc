// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/depth_estimation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "fusion/depth/dominant_planes.h"
#include "fusion/depth/inverse_depth_map.h"
#include "fusion/depth/sweep_geometry.h"
#include "fusion/depth/view_pyramid.h"
#include "kernels/scanline.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr uint32_t kBytesPerCost = 3;  // a byte in the volume, two in the sums over directions
// Chosen by hand; no measurement is recorded.
constexpr uint32_t kHalfSideMin = 48;   // px; smaller views are not halved to look for planes
constexpr uint32_t kFamilyPlanes = 16;  // parallel to a dominant plane, half a step apart
constexpr uint32_t kRefinementPlanes =
    16;  // a quarter of a step apart: from 2 px before to 2 px behind the surface
constexpr double kFamilySpacing = 0.5, kRefinementSpacing = 0.25;  // steps of 1 px
constexpr double kEdgePx =
    1.0;  // neighbours further apart than this in the sensor views are not one surface
constexpr uint32_t kPriorPatchPixels = 40;  // smaller patches are no surface to sweep along
constexpr double kGraySlope =
    8;  // gray levels of difference at which penalty_large has fallen by half
constexpr uint8_t kVoteDistinctness = 30;  // of pixels that vote for a dominant plane
constexpr double kFullDistinctness =
    128;                             // sums over directions; from here on confidence does not grow
constexpr double kWorstCost = 60;    // of one direction; from here on there is no confidence
constexpr double kDominantPx = 0.5;  // how far from a plane its pixels are, at half the size

// The views at one size.
struct Level {
  View key;
  std::vector<View> sensors;
  double px = 0;        // inverse depth that moves a point by 1 px in a sensor view
  PlaneSpacing planes;  // over the whole range
};

Status CheckView(const View& view, const std::string& name) {
  const ViewGeometry& g = view.geometry;
  if (g.width_px < 2 || g.height_px < 2 || g.width_px > 65535 || g.height_px > 65535) {
    return Status::InvalidArgument(name + " is " + std::to_string(g.width_px) + "x" +
                                   std::to_string(g.height_px) +
                                   "; it must have 2 to 65535 px each way");
  }
  if (view.gray.size() != static_cast<size_t>(g.width_px) * g.height_px) {
    return Status::InvalidArgument(name + " has " + std::to_string(view.gray.size()) +
                                   " gray pixels, not " + std::to_string(g.width_px) + "x" +
                                   std::to_string(g.height_px));
  }
  const bool finite = std::isfinite(g.camera.cx) && std::isfinite(g.camera.cy) &&
                      std::isfinite(g.camera.fx) && std::isfinite(g.camera.fy) &&
                      g.cam_from_world.translation.allFinite() &&
                      g.cam_from_world.rotation.coeffs().allFinite();
  if (!finite || g.camera.fx <= 0 || g.camera.fy <= 0) {
    return Status::InvalidArgument(
        name + "'s camera or pose is not finite, or its focal length not positive");
  }
  return Status::Ok();
}

Status CheckInput(const View& key, std::span<const View> sensors, const DepthRange& range) {
  VEDUTA_RETURN_IF_ERROR(CheckView(key, "the key view"));
  if (sensors.empty() || sensors.size() > kSweepSensorsMax) {
    return Status::InvalidArgument(std::to_string(sensors.size()) +
                                   " sensor views; there must be 1 to " +
                                   std::to_string(kSweepSensorsMax));
  }
  for (size_t s = 0; s < sensors.size(); ++s) {
    VEDUTA_RETURN_IF_ERROR(CheckView(sensors[s], "sensor view " + std::to_string(s)));
  }
  if (!(range.near > 0 && range.far > range.near && std::isfinite(range.near))) {
    return Status::InvalidArgument("the depth range is " + std::to_string(range.near) + " to " +
                                   std::to_string(range.far) + "; it must be positive and grow");
  }
  return Status::Ok();
}

// False if no sensor view sees anything of the range.
bool MeasureLevel(const DepthRange& range, const DepthOptions& options, Level* level) {
  std::vector<ViewGeometry> geometries;
  for (const View& sensor : level->sensors) geometries.push_back(sensor.geometry);
  const double first = 1 / range.far, last = 1 / range.near;
  const double speed = PixelsPerInverseDepth(level->key.geometry, geometries, first, last);
  if (!(speed > 0)) return false;
  level->px = 1 / speed;
  level->planes = SpacePlanes(first, last, speed, options.plane_step_px, options.plane_count_max);
  return true;
}

Level HalveLevel(const Level& level) {
  Level half;
  half.key = HalveView(level.key);
  for (const View& sensor : level.sensors) half.sensors.push_back(HalveView(sensor));
  return half;
}

bool CanHalve(const Level& level) {
  const auto is_large = [](const View& v) {
    return std::min(v.geometry.width_px, v.geometry.height_px) >= 2 * kHalfSideMin;
  };
  return is_large(level.key) && std::all_of(level.sensors.begin(), level.sensors.end(), is_large);
}

double VolumeBytes(uint64_t pixel_count, uint32_t plane_count) {
  return static_cast<double>(pixel_count) * PlaneStride(plane_count) * kBytesPerCost;
}

double VolumeBytes(const Level& level, uint32_t plane_count) {
  return VolumeBytes(level.key.gray.size(), plane_count);
}

// Of the planes that are parallel to dominant ones.
uint32_t FamilyLabels(const DepthOptions& options) {
  return options.slanted_plane_count * (kFamilyPlanes + 1);
}

std::vector<SweepPlane> FrontoParallel(const PlaneSpacing& spacing) {
  std::vector<SweepPlane> planes;
  for (uint32_t k = 0; k < spacing.count; ++k)
    planes.push_back({0, 0, static_cast<float>(spacing.first + k * spacing.step)});
  return planes;
}

// Planes `step` apart, half of them behind and half before `middle`.
void AppendAround(const PlaneInView& middle, uint32_t count, double step,
                  std::vector<SweepPlane>* planes) {
  for (uint32_t k = 0; k < count; ++k) {
    const double offset = (static_cast<double>(k) - count / 2) * step;
    planes->push_back({static_cast<float>(middle.x), static_cast<float>(middle.y),
                       static_cast<float>(middle.constant + offset)});
  }
}

SweepProblem MakeProblem(const Level& level, std::vector<SweepPlane> planes) {
  SweepProblem problem;
  problem.key = {level.key.geometry.width_px, level.key.geometry.height_px, level.key.gray.data()};
  for (const View& view : level.sensors) {
    const SweepGeometry geometry(level.key.geometry, view.geometry);
    SweepSensor sensor;
    sensor.image = {view.geometry.width_px, view.geometry.height_px, view.gray.data()};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        sensor.rotation[static_cast<size_t>(3 * r + c)] =
            static_cast<float>(geometry.rotation(r, c));
      sensor.translation[static_cast<size_t>(r)] = static_cast<float>(geometry.translation(r));
    }
    problem.sensors.push_back(sensor);
  }
  problem.planes = std::move(planes);
  return problem;
}

// Over 5 x 5, fewer at the borders.
std::vector<uint8_t> MeanOfNeighbors(const std::vector<uint8_t>& values, uint32_t width,
                                     uint32_t height) {
  constexpr int kRadius = 2;
  std::vector<uint8_t> means(values.size());
  for (int y = 0; y < static_cast<int>(height); ++y) {
    for (int x = 0; x < static_cast<int>(width); ++x) {
      uint32_t sum = 0, count = 0;
      for (int v = std::max(0, y - kRadius);
           v <= std::min(static_cast<int>(height) - 1, y + kRadius); ++v) {
        for (int u = std::max(0, x - kRadius);
             u <= std::min(static_cast<int>(width) - 1, x + kRadius); ++u) {
          sum += values[static_cast<size_t>(v) * width + static_cast<size_t>(u)];
          ++count;
        }
      }
      means[static_cast<size_t>(y) * width + static_cast<size_t>(x)] =
          static_cast<uint8_t>(sum / count);
    }
  }
  return means;
}

class Estimator final {
 public:
  Estimator(const DepthRange& range, const DepthOptions& options, Device* device, ThreadPool& pool,
            const std::stop_token& stop)
      : range_(range), options_(options), device_(device), pool_(pool), stop_(stop) {
    for (size_t g = 0; g < scanline_.penalty_large.size(); ++g) {
      const double least = options.penalty_large_min, most = options.penalty_large;
      scanline_.penalty_large[g] = static_cast<uint8_t>(
          least + (most - least) * kGraySlope / (kGraySlope + static_cast<double>(g)));
    }
    scanline_.penalty_small = static_cast<uint8_t>(options.penalty_small);
  }

  Result<DepthMap> Run(const View& key, std::span<const View> sensors) {
    VEDUTA_RETURN_IF_ERROR(MakeLevels(key, sensors));
    VEDUTA_RETURN_IF_ERROR(SweepCoarsest());
    for (size_t i = start_ + 1; i-- > 0;) {
      if (i < start_) Grow(levels_[i]);
      const uint32_t count = i > 0 ? 1 : options_.refinement_count;
      for (uint32_t r = 0; r < count; ++r) VEDUTA_RETURN_IF_ERROR(SweepAlongSurface(levels_[i]));
    }
    return Finish();
  }

 private:
  // Level 0 is the full size, `start_` the first whose volume of planes fits, and where it can be
  // halved again there is one level more.
  Status MakeLevels(const View& key, std::span<const View> sensors) {
    levels_.emplace_back();
    levels_[0].key = key;
    levels_[0].sensors.assign(sensors.begin(), sensors.end());
    if (!MeasureLevel(range_, options_, &levels_[0])) {
      return Status::InvalidArgument("no sensor view sees anything of the key view between " +
                                     std::to_string(range_.near) + " and " +
                                     std::to_string(range_.far));
    }
    const double budget = static_cast<double>(options_.volume_bytes_max);
    const auto whole = [&](const Level& level) {
      return VolumeBytes(level, level.planes.count + FamilyLabels(options_));
    };
    while (whole(levels_.back()) > budget) {
      const double smallest =
          std::max(whole(levels_.back()), VolumeBytes(levels_[0], kRefinementPlanes));
      if (!CanHalve(levels_.back())) return TooLarge(smallest);
      levels_.push_back(HalveLevel(levels_.back()));
      if (!MeasureLevel(range_, options_, &levels_.back())) return TooLarge(smallest);
    }
    if (VolumeBytes(levels_[0], kRefinementPlanes) > budget)
      return TooLarge(VolumeBytes(levels_[0], kRefinementPlanes));
    start_ = levels_.size() - 1;
    if (!CanHalve(levels_.back())) return Status::Ok();
    levels_.push_back(HalveLevel(levels_.back()));
    if (!MeasureLevel(range_, options_, &levels_.back())) levels_.pop_back();
    return Status::Ok();
  }

  Status TooLarge(double bytes) const {
    const uint64_t needed = static_cast<uint64_t>(bytes), given = options_.volume_bytes_max;
    return Status::InvalidArgument(
        "the costs of " + std::to_string(levels_[0].key.geometry.width_px) + "x" +
        std::to_string(levels_[0].key.geometry.height_px) + " px need " +
        std::to_string(needed >> 20) + " MiB, and volume_bytes_max allows " +
        std::to_string(given >> 20) + "; compute at a smaller size or allow more");
  }

  // Over the whole range: at half the size to see how much stands out and which planes there are,
  // then with families of planes parallel to these.
  Status SweepCoarsest() {
    std::vector<SweepPlane> planes = FrontoParallel(levels_[start_].planes);
    if (levels_.size() > start_ + 1) {
      const Level& half = levels_.back();
      VEDUTA_RETURN_IF_ERROR(Sweep(half, FrontoParallel(half.planes), {}));
      KeepDistinctness();
      std::vector<uint8_t> votes(distinctness_.size());
      for (size_t i = 0; i < votes.size(); ++i) votes[i] = distinctness_[i] >= kVoteDistinctness;
      const auto found =
          FindDominantPlanes(map_, votes, half.px * kDominantPx, options_.slanted_plane_count);
      for (const PlaneInView& plane : found) {
        // Pixel x of the half lies between pixels 2x and 2x + 1 of the whole.
        const PlaneInView whole = {plane.x / 2, plane.y / 2,
                                   plane.constant - (plane.x + plane.y) / 4};
        planes.push_back(SweepPlane::Gap());
        AppendAround(whole, kFamilyPlanes, levels_[start_].px * kFamilySpacing, &planes);
      }
    }
    const bool has_half = !distinctness_.empty();
    VEDUTA_RETURN_IF_ERROR(Sweep(levels_[start_], std::move(planes), {}));
    if (has_half) {
      GrowDistinctness();
    } else {
      KeepDistinctness();
    }
    return Status::Ok();
  }

  // Offsets from what was found: it is cleaned and smoothed first.
  Status SweepAlongSurface(const Level& level) {
    RemoveSpeckles(level.px * kEdgePx, kPriorPatchPixels, &map_);
    FillFromBackground(static_cast<float>(1 / range_.far), &map_);
    map_ = SmoothBetweenEdges(map_, level.px * kEdgePx, pool_);
    std::vector<SweepPlane> planes;
    AppendAround({}, kRefinementPlanes, level.px * kRefinementSpacing, &planes);
    return Sweep(level, std::move(planes), std::move(map_.w));
  }

  Status Sweep(const Level& level, std::vector<SweepPlane> planes, std::vector<float> base) {
    SweepProblem problem = MakeProblem(level, std::move(planes));
    problem.base = std::move(base);
    VEDUTA_ASSIGN_OR_RETURN(choice_, SweepAndChoose(problem, scanline_, device_, pool_, stop_));
    map_ = RefineBetweenPlanes(choice_, problem.key.width_px, problem.key.height_px, problem.base,
                               problem.planes);
    return Status::Ok();
  }

  void KeepDistinctness() {
    distinctness_width_ = map_.width_px;
    distinctness_height_ = map_.height_px;
    std::vector<uint8_t> each(map_.w.size());
    for (size_t i = 0; i < each.size(); ++i) {
      each[i] = static_cast<uint8_t>(std::min(255, choice_.cost_second[i] - choice_.cost[i]));
    }
    distinctness_ = MeanOfNeighbors(each, map_.width_px, map_.height_px);
  }

  // To the map's size.
  void GrowDistinctness() {
    std::vector<uint8_t> grown(map_.w.size());
    for (uint32_t y = 0; y < map_.height_px; ++y) {
      const size_t row =
          static_cast<size_t>(std::min(y / 2, distinctness_height_ - 1)) * distinctness_width_;
      for (uint32_t x = 0; x < map_.width_px; ++x) {
        grown[static_cast<size_t>(y) * map_.width_px + x] =
            distinctness_[row + std::min(x / 2, distinctness_width_ - 1)];
      }
    }
    distinctness_ = std::move(grown);
    distinctness_width_ = map_.width_px;
    distinctness_height_ = map_.height_px;
  }

  void Grow(const Level& level) {
    map_ = Enlarge(map_, level.key.geometry.width_px, level.key.geometry.height_px);
    GrowDistinctness();
  }

  uint8_t Confidence(size_t pixel) const {
    const double cost =
        choice_.cost[pixel] / static_cast<double>(kScanDirections);  // of one direction
    const double match = std::clamp((kWorstCost - cost) / kWorstCost, 0.0, 1.0);
    const double distinct = std::min(1.0, distinctness_[pixel] / kFullDistinctness);
    return static_cast<uint8_t>(std::lround(255 * match * distinct));
  }

  DepthMap Finish() {
    const Level& level = levels_[0];
    InverseDepthMap smooth = SmoothBetweenEdges(map_, level.px * kEdgePx, pool_);
    DepthMap out{map_.width_px, map_.height_px, std::vector<float>(map_.w.size()),
                 std::vector<uint8_t>(map_.w.size())};
    for (size_t i = 0; i < smooth.w.size(); ++i) {
      if (Confidence(i) < options_.confidence_min)
        smooth.w[i] = std::numeric_limits<float>::quiet_NaN();
    }
    RemoveSpeckles(level.px * kEdgePx, options_.speckle_pixels_min, &smooth);
    for (size_t i = 0; i < smooth.w.size(); ++i) {
      if (!(smooth.w[i] > 0)) continue;
      out.depth[i] = 1 / smooth.w[i];
      out.confidence[i] = std::max<uint8_t>(1, Confidence(i));
    }
    return out;
  }

  const DepthRange& range_;
  const DepthOptions& options_;
  Device* device_;
  ThreadPool& pool_;
  const std::stop_token& stop_;
  ScanlineOptions scanline_;
  std::vector<Level> levels_;
  size_t start_ = 0;
  InverseDepthMap map_;
  PlaneChoice choice_;
  std::vector<uint8_t>
      distinctness_;  // how much the best plane is better than any other but its neighbours
  uint32_t distinctness_width_ = 0, distinctness_height_ = 0;
};

}  // namespace

Status DepthOptions::Check() const {
  return OptionBounds()
      .Between("plane_step_px", plane_step_px, 0.25, 8)
      .Between("plane_count_max", plane_count_max, 16, 768)
      .Between("volume_bytes_max", static_cast<double>(volume_bytes_max), 0x1p20, 0x1p36)
      .Between("slanted_plane_count", slanted_plane_count, 0, 8)
      .Between("refinement_count", refinement_count, 0, 8)
      .Between("penalty_small", penalty_small, 0, 127)
      .Between("penalty_large", penalty_large, 0, 128)
      .Between("penalty_large_min", penalty_large_min, 0, penalty_large)
      .Between("confidence_min", confidence_min, 0, 255)
      .status();
}

uint64_t DepthVolumeBytes(const ViewGeometry& key, const DepthOptions& options) {
  const double most = VolumeBytes(uint64_t{key.width_px} * key.height_px,
                                  options.plane_count_max + FamilyLabels(options));
  return std::min(options.volume_bytes_max, static_cast<uint64_t>(most));
}

Result<DepthMap> EstimateDepth(const View& key, std::span<const View> sensors,
                               const DepthRange& range, const DepthOptions& options, Device* device,
                               ThreadPool& pool, const std::stop_token& stop) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckInput(key, sensors, range));
  return Estimator(range, options, device, pool, stop).Run(key, sensors);
}

}  // namespace veduta
