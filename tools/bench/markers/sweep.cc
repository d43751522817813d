// SPDX-License-Identifier: Apache-2.0
// Detection on rendered photos, one influence at a time.
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "storage/base/content_hash.h"
#include "tools/bench/markers/bench.h"
#include "tools/render/floor/session.h"

namespace veduta::floor {
namespace {

// One setting: photos of a floor seen from a distance at which a marker has the size wanted.
struct Setting {
  std::string label;
  double diameter_px = 80, tilt_deg = 30;
  FloorPhotoOptions photo;
  Flooring flooring = Flooring::kWood;
  bool is_scattered = false;  // with floor between the sheets
  double cover = 0;           // part of every ring that something lies on
  int jpeg_quality = 90;
};

CameraModel SweepCamera() {
  CameraModel model;
  model.width_px = 1400;
  model.height_px = 1050;
  model.fx = model.fy = 1300;
  model.cx = model.u0 = 703.3;
  model.cy = model.v0 = 520.8;
  model.k1 = -0.1;
  model.k2 = 0.02;
  return model;
}

// Rectangles that lie over a part of each marker, from outside up to a chord; dark, grey and bright
// in turn.
std::vector<Cover> CoversOf(const Floor& floor, double part) {
  std::vector<Cover> covers;
  if (part <= 0) return covers;
  for (const FloorMarker& marker : floor.markers()) {
    SeededRandom random(MixSeed(99, marker.id));
    const double angle = 2 * std::numbers::pi * random.Unit();
    // A chord that cuts off the arc `part` of the ring lies at cos(pi part) of the radius.
    const double near_m = marker.radius_m * std::cos(std::numbers::pi * part),
                 deep_m = 1.3 * marker.radius_m;
    const double middle_m = (near_m + deep_m) / 2;
    Cover cover;
    cover.center_m =
        marker.center_m.head<2>() + middle_m * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    cover.half_m = {(deep_m - near_m) / 2, 1.3 * marker.radius_m};
    cover.angle_rad = angle;
    cover.reflectance = std::vector<double>{0.04, 0.3, 0.85}[marker.id % 3];
    covers.push_back(cover);
  }
  return covers;
}

void Measure(const Setting& setting, uint32_t photos) {
  FloorOptions options;
  options.is_scattered = setting.is_scattered;
  options.flooring = setting.flooring;
  const Floor bare = Floor::Build(options).value();
  options.covers = CoversOf(bare, setting.cover);
  const Floor floor = Floor::Build(options).value();
  const CameraModel model = SweepCamera();
  const double distance_m = model.fx * 2 * floor.markers().front().radius_m / setting.diameter_px;
  std::vector<PhotoOutcome> outcomes;
  double seconds = 0;
  for (uint32_t i = 0; i < photos; ++i) {
    SeededRandom random(MixSeed(7, i));
    const Eigen::Vector2d target_m(0.3 * random.Unit(), 0.3 * random.Unit());
    const FloorCamera camera = {
        "", model,
        LookDown(target_m, distance_m, setting.tilt_deg, 360 * random.Unit(), 360 * random.Unit())};
    FloorPhotoOptions photo = setting.photo;
    photo.seed = i;
    photo.motion_deg = 180 * random.Unit();
    const cv::Mat rendered = RenderFloorPhoto(floor, camera, photo).value();
    std::vector<uint8_t> jpeg;
    cv::imencode(".jpg", rendered, jpeg, {cv::IMWRITE_JPEG_QUALITY, setting.jpeg_quality});
    const cv::Mat gray = cv::imdecode(jpeg, cv::IMREAD_GRAYSCALE);
    const std::clock_t begin = std::clock();
    const auto search = DetectMarkers(gray);
    seconds += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    std::vector<MarkerTruth> truths = TrueMarkers(floor, camera);
    if (setting.cover > 0) {  // the rate is that of covered markers then
      for (MarkerTruth& truth : truths) truth.cover = 0;
    }
    outcomes.push_back(Compare(truths, search->markers));
  }
  PrintOutcome(setting.label, outcomes, seconds);
}

}  // namespace

int RunSweep(uint32_t photos, const std::string& only) {
  std::printf(
      "found/whole, wrong ids, error px (median, 95 %%), ellipse centre's, sigma, squared error in "
      "sigmas\n");
  const auto label = [](const char* text, double value) {
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, "%s %g", text, value);
    return std::string(buffer);
  };
  std::vector<Setting> settings;
  const auto add = [&](const char* text, double value, const auto& change) {
    Setting setting;
    setting.label = label(text, value);
    change(&setting);
    settings.push_back(setting);
  };
  for (const double px : {16, 20, 24, 30, 40, 60, 100, 200, 400}) {
    add("size px", px, [&](Setting* s) { s->diameter_px = px; });
  }
  for (const double deg : {0, 20, 40, 50, 60, 65, 70}) {
    add("tilt deg", deg, [&](Setting* s) { s->tilt_deg = deg; });
  }
  for (const double px : {0.4, 1.0, 2.0, 3.0, 4.0, 6.0}) {
    add("focus sigma px", px, [&](Setting* s) { s->photo.blur_sigma_px = px; });
  }
  for (const double px : {2, 4, 8, 12, 16}) {
    add("motion px", px, [&](Setting* s) { s->photo.motion_px = px; });
  }
  for (const double part : {0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5}) {
    add("covered", part, [&](Setting* s) { s->cover = part; });
  }
  for (const double part : {0.0, 0.5, 0.8, 0.95}) {
    add("unevenness", part, [&](Setting* s) { s->photo.unevenness = part; });
  }
  for (const double sigma : {0, 4, 8, 16}) {
    add("noise", sigma, [&](Setting* s) { s->photo.noise_sigma = sigma; });
  }
  for (const double quality : {30, 60, 95}) {
    add("JPEG quality", quality, [&](Setting* s) { s->jpeg_quality = static_cast<int>(quality); });
  }
  for (const double exposure : {0.05, 0.2, 2.0, 4.0}) {
    add("exposure", exposure, [&](Setting* s) { s->photo.exposure = exposure; });
  }
  for (int i = 0; i < 4; ++i) {
    add(FlooringNames()[i].data(), 0, [&](Setting* s) {
      s->flooring = static_cast<Flooring>(i);
      s->is_scattered = true;
      s->diameter_px = 50;
    });
  }
  for (const Setting& setting : settings) {
    if (setting.label.starts_with(only)) Measure(setting, photos);
  }
  return 0;
}

}  // namespace veduta::floor
