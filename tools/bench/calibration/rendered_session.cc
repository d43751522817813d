// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/calibration/rendered_session.h"

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "engine/camera/markers/photo_markers.h"
#include "engine/camera/photo_decoder.h"
#include "storage/base/content_hash.h"
#include "tools/render/floor/session.h"

namespace veduta {
namespace {

floor::SessionOptions RenderOptions(uint32_t index) {
  SessionOptions drawn = ExperimentOptions(index);
  drawn.size = {1600, 1200};
  SeededRandom random(MixSeed(0xf1008, index));
  const auto between = [&](double low, double high) { return low + (high - low) * random.Unit(); };
  floor::SessionOptions options;
  options.seed = options.floor.seed = options.photo.seed = random.Below(1u << 31);
  options.model = MakeSession(drawn).truth;
  options.photos = drawn.photo_count;
  options.tilt_deg_max = 50;
  options.floor.flooring = static_cast<floor::Flooring>(index % 4);
  options.floor.bend_mm = between(0, 3);
  options.floor.cover_count = random.Below(12);
  options.photo.noise_sigma = between(1, 4);
  options.photo.blur_sigma_px = between(0.5, 1);
  options.blur_sigma_px_max = between(0, 1);
  options.motion_px_max = between(0, 3);
  options.photo.vignetting = between(0.1, 0.5);
  options.photo.unevenness = between(0.2, 0.6);
  return options;
}

// The way of a photo from the camera's file to its grey values.
cv::Mat ThroughJpeg(const cv::Mat& photo, int quality, const std::string& path) {
  std::vector<uint8_t> jpeg;
  VEDUTA_CHECK(cv::imencode(".jpg", photo, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality}),
               "a photo that is no JPEG");
  if (!path.empty()) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(jpeg.data()),
               static_cast<std::streamsize>(jpeg.size()));
  }
  return DecodePhoto(jpeg, {}, {}).gray;
}

}  // namespace

RenderedSession RenderSession(uint32_t index, const std::string& keep, ThreadPool* pool) {
  const floor::SessionOptions options = RenderOptions(index);
  const floor::Floor floor = floor::Floor::Build(options.floor).value();
  const std::vector<floor::FloorCamera> cameras =
      floor::SessionCameras(options, floor.extent_m()).value();
  RenderedSession rendered;
  rendered.session.truth = options.model;
  for (const floor::FloorMarker& marker : floor.markers())
    rendered.session.points.push_back(marker.center_m);
  MarkerOptions markers;
  markers.id_count = options.floor.marker_count;
  std::vector<ViewObservations> views(cameras.size());
  rendered.found.resize(cameras.size());
  pool->ParallelFor(cameras.size(), [&](size_t i) {
    const std::string path =
        keep.empty() ? "" : keep + "/session" + std::to_string(index) + "_" + cameras[i].name;
    const cv::Mat photo = floor::RenderSessionPhoto(floor, cameras[i], options, i).value();
    const MarkerSearch search =
        DetectMarkers(ThroughJpeg(photo, options.jpeg_quality, path), markers).value();
    rendered.found[i] = floor::Compare(floor::TrueMarkers(floor, cameras[i]), search.markers);
    views[i].name = cameras[i].name;
    views[i].size = {options.model.width_px, options.model.height_px};
    for (const MarkerDetection& m : search.markers)
      views[i].points.push_back({m.id, m.center_px, m.SigmaPx()});
  });
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i].points.size() < PhotoMarkersOptions().marker_count_min) {
      ++rendered.useless_count;
      continue;
    }
    rendered.session.cams_from_world.push_back(cameras[i].cam_from_world);
    rendered.session.input.views.push_back(std::move(views[i]));
  }
  return rendered;
}

}  // namespace veduta
