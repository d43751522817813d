// SPDX-License-Identifier: Apache-2.0
// A rendered street. Each key view takes the two sensor views that score best by overlap and angle
// (as section 4.1 of the paper ranks them, with the true depth in place of the points), and its
// range from the 1st and 99th percentile of its true depth, widened by 20 % as sparse points would
// have it. A pixel counts where its true surface is seen in both.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "fusion/depth/depth_consistency.h"
#include "fusion/depth/sweep_geometry.h"
#include "storage/base/median.h"
#include "tools/dense/depth_benchmark.h"
#include "tools/street/truth_file.h"

namespace veduta {
namespace {

constexpr double kBestAngleDeg = 6, kOverlapMin = 0.3, kWidening = 1.2, kVisibleError = 0.01;
constexpr uint32_t kSampleStep = 16;

struct Photo {
  std::string name;
  View view;
  street::DepthMap truth;
};

struct Figures {
  size_t counted = 0, known = 0, right = 0, sky = 0, sky_known = 0, all_known = 0, all_right = 0;
  std::vector<float> errors;  // relative, of counted pixels that are known
};

Result<std::vector<Photo>> ReadPhotos(const std::string& folder) {
  std::vector<Photo> photos;
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder + "/photos", error)) {
    names.push_back(entry.path().stem().string());
  }
  if (names.empty()) return Status::IoError(folder + "/photos has no photos");
  std::sort(names.begin(), names.end());
  for (const std::string& name : names) {
    Photo photo;
    photo.name = name;
    VEDUTA_ASSIGN_OR_RETURN(const street::StreetCamera camera,
                            street::ReadCameraFile(folder + "/truth/" + name + ".jpg.camera"));
    VEDUTA_ASSIGN_OR_RETURN(photo.truth,
                            street::ReadDepthFile(folder + "/truth/" + name + ".jpg.depth"));
    const cv::Mat gray = cv::imread(folder + "/photos/" + name + ".jpg", cv::IMREAD_GRAYSCALE);
    if (gray.empty()) return Status::IoError(name + ".jpg cannot be read");
    photo.view.geometry = {camera.model.width_px, camera.model.height_px, Pinhole(camera.model),
                           camera.cam_from_world};
    photo.view.gray.assign(gray.datastart, gray.dataend);
    photos.push_back(std::move(photo));
  }
  return photos;
}

// Whether the sensor view sees the key view's true surface at a pixel.
bool Sees(const SweepGeometry& geometry, const Photo& sensor, double x, double y, double depth) {
  const Eigen::Vector3d at = depth * geometry.Ray(x, y, 1 / depth);
  if (!(at.z() > 0)) return false;
  const long u = std::lround(at.x() / at.z()), v = std::lround(at.y() / at.z());
  if (u < 0 || v < 0 || u >= sensor.truth.width_px || v >= sensor.truth.height_px) return false;
  const size_t pixel = static_cast<size_t>(v) * sensor.truth.width_px + static_cast<size_t>(u);
  const double there = sensor.truth.depth[pixel];
  // Slanted surfaces change by more than that from pixel centre to pixel centre.
  const double tolerance = kVisibleError * 3;
  return there > 0 && std::abs(there - at.z()) <= tolerance * at.z();
}

double Score(const Photo& key, const Photo& sensor) {
  const SweepGeometry geometry(key.view.geometry, sensor.view.geometry);
  const Rigid3 sensor_from_key =
      sensor.view.geometry.cam_from_world * key.view.geometry.cam_from_world.Inverse();
  const Eigen::Vector3d center = sensor_from_key.Center();
  std::vector<double> angles;
  size_t count = 0;
  for (uint32_t y = 0; y < key.truth.height_px; y += kSampleStep) {
    for (uint32_t x = 0; x < key.truth.width_px; x += kSampleStep) {
      const double depth = key.truth.depth[static_cast<size_t>(y) * key.truth.width_px + x];
      if (depth <= 0) continue;
      ++count;
      if (!Sees(geometry, sensor, x, y, depth)) continue;
      const Eigen::Vector2d n = key.view.geometry.camera.Normalize(Eigen::Vector2d(x, y));
      const Eigen::Vector3d point = depth * Eigen::Vector3d(n.x(), n.y(), 1);
      const double cosine = point.normalized().dot((point - center).normalized());
      angles.push_back(std::acos(std::min(1.0, cosine)) * 180 / M_PI);
    }
  }
  const double overlap =
      count == 0 ? 0 : static_cast<double>(angles.size()) / static_cast<double>(count);
  if (angles.empty() || overlap < kOverlapMin) return 0;
  const double angle = MedianOf(std::move(angles));
  return overlap * angle * angle * std::exp(-2 * angle / kBestAngleDeg);
}

std::vector<size_t> ChooseSensors(const std::vector<Photo>& photos, size_t key) {
  std::vector<std::pair<double, size_t>> scores;
  for (size_t i = 0; i < photos.size(); ++i) {
    if (i != key) scores.push_back({Score(photos[key], photos[i]), i});
  }
  std::sort(scores.rbegin(), scores.rend());
  return {scores[0].second, scores[1].second};
}

DepthRange RangeOf(const street::DepthMap& truth) {
  std::vector<float> depths;
  for (const float depth : truth.depth) {
    if (depth > 0) depths.push_back(depth);
  }
  std::sort(depths.begin(), depths.end());
  return {depths[depths.size() / 100] / kWidening,
          depths[depths.size() - 1 - depths.size() / 100] * kWidening};
}

void Compare(const DepthMap& map, const Photo& key, const std::vector<size_t>& sensors,
             const std::vector<Photo>& photos, Figures* figures) {
  std::vector<SweepGeometry> geometries;
  for (const size_t s : sensors)
    geometries.emplace_back(key.view.geometry, photos[s].view.geometry);
  for (uint32_t y = 0; y < map.height_px; ++y) {
    for (uint32_t x = 0; x < map.width_px; ++x) {
      const float truth = key.truth.depth[static_cast<size_t>(y) * map.width_px + x],
                  depth = map.at(x, y);
      if (truth <= 0) {
        ++figures->sky;
        figures->sky_known += depth > 0;
        continue;
      }
      const float error = std::abs(depth - truth) / truth;
      figures->all_known += depth > 0;
      figures->all_right += depth > 0 && error < 0.01f;
      if (!Sees(geometries[0], photos[sensors[0]], x, y, truth) ||
          !Sees(geometries[1], photos[sensors[1]], x, y, truth)) {
        continue;
      }
      ++figures->counted;
      if (depth <= 0) continue;
      ++figures->known;
      figures->right += error < 0.01f;
      figures->errors.push_back(error);
    }
  }
}

void Print(const char* what, Figures& f) {
  std::sort(f.errors.begin(), f.errors.end());
  const auto percent = [](size_t part, size_t whole) {
    return 100.0 * static_cast<double>(part) / static_cast<double>(std::max<size_t>(1, whole));
  };
  std::printf(
      "%s: of %zu pixels seen in both sensor views %.2f %% within 1 %% of the truth, %.2f %% "
      "known; median "
      "error %.3f %%; of all known pixels %.2f %% within 1 %%; sky given a depth %.1f %%\n",
      what, f.counted, percent(f.right, f.counted), percent(f.known, f.counted),
      f.errors.empty() ? 100.0 : 100.0 * f.errors[f.errors.size() / 2],
      percent(f.all_right, f.all_known), percent(f.sky_known, f.sky));
}

void WritePicture(const BenchmarkSetting& setting, const std::string& name, const DepthMap& map,
                  const street::DepthMap& truth) {
  if (setting.pictures.empty()) return;
  const DepthRange range = RangeOf(truth);
  const int width = static_cast<int>(map.width_px), height = static_cast<int>(map.height_px);
  cv::Mat pictures(height, 3 * width, CV_8UC3, cv::Scalar(0, 0, 0));
  const auto paint = [&](const float* depth, int left) {
    cv::Mat gray(height, width, CV_8U, cv::Scalar(0)), color;
    for (int i = 0; i < width * height; ++i) {
      const double w =
          depth[i] > 0 ? (1 / depth[i] - 1 / range.far) / (1 / range.near - 1 / range.far) : 0;
      gray.data[i] = static_cast<uint8_t>(std::clamp(w * 255, 0.0, 255.0));
    }
    cv::applyColorMap(gray, color, cv::COLORMAP_JET);
    for (int i = 0; i < width * height; ++i) {
      if (!(depth[i] > 0)) color.at<cv::Vec3b>(i / width, i % width) = {0, 0, 0};
    }
    color.copyTo(pictures(cv::Rect(left, 0, width, height)));
  };
  paint(truth.depth.data(), 0);
  paint(map.depth.data(), width);
  for (int i = 0; i < width * height; ++i) {
    const size_t p = static_cast<size_t>(i);
    const float error = truth.depth[p] > 0 && map.depth[p] > 0
                            ? std::abs(map.depth[p] - truth.depth[p]) / truth.depth[p]
                            : 0;
    const uint8_t level = static_cast<uint8_t>(std::min(255.f, error * 12750));  // white at 2 %
    cv::Vec3b color(level, level, level);
    if (truth.depth[p] <= 0) color = {map.depth[p] > 0 ? uint8_t{255} : uint8_t{60}, 60, 0};
    if (truth.depth[p] > 0 && map.depth[p] <= 0) color = {0, 0, 160};
    pictures.at<cv::Vec3b>(i / width, 2 * width + i % width) = color;
  }
  cv::imwrite(setting.pictures + "/" + name + ".png", pictures);
}

}  // namespace

Status RunStreet(const std::string& folder, uint32_t key_count, const BenchmarkSetting& setting) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<Photo> photos, ReadPhotos(folder));
  if (photos.size() < 3) return Status::InvalidArgument(folder + " has fewer than 3 photos");
  std::map<size_t, DepthMap> maps;  // by photo; each is estimated once
  std::map<size_t, std::vector<size_t>> sensors;
  double seconds = 0;
  const auto estimate = [&](size_t key) -> Status {
    if (maps.count(key) > 0) return Status::Ok();
    sensors[key] = ChooseSensors(photos, key);
    std::vector<View> views;
    for (const size_t s : sensors[key]) views.push_back(photos[s].view);
    const auto start = std::chrono::steady_clock::now();
    VEDUTA_ASSIGN_OR_RETURN(
        maps[key], EstimateDepth(photos[key].view, views, RangeOf(photos[key].truth), setting.depth,
                                 setting.device, *setting.pool));
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return Status::Ok();
  };
  Figures raw, checked;
  for (size_t i = 0; i < key_count; ++i) {
    const size_t key = (2 * i + 1) * photos.size() / (2 * key_count);
    VEDUTA_RETURN_IF_ERROR(estimate(key));
    Compare(maps[key], photos[key], sensors[key], photos, &raw);
    std::vector<NeighborDepth> neighbors;
    for (const size_t s : sensors[key]) {
      VEDUTA_RETURN_IF_ERROR(estimate(s));
      neighbors.push_back({photos[s].view.geometry, &maps[s]});
    }
    VEDUTA_ASSIGN_OR_RETURN(
        const DepthMap map,
        CheckConsistency(maps[key], photos[key].view.geometry, neighbors, {}, *setting.pool));
    Compare(map, photos[key], sensors[key], photos, &checked);
    WritePicture(setting, photos[key].name + "_raw", maps[key], photos[key].truth);
    WritePicture(setting, photos[key].name + "_checked", map, photos[key].truth);
  }
  std::printf("%u key views, %.3f s a depth map\n", key_count,
              seconds / static_cast<double>(maps.size()));
  Print("estimated", raw);
  Print("checked", checked);
  return Status::Ok();
}

}  // namespace veduta
