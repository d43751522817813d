// SPDX-License-Identifier: Apache-2.0
#include "tools/render/floor/session.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <mutex>
#include <opencv2/imgcodecs.hpp>

#include "storage/base/angle.h"
#include "storage/base/content_hash.h"
#include "storage/base/thread_pool.h"
#include "tools/render/street/truth_file.h"

namespace veduta::floor {
namespace {

namespace fs = std::filesystem;

Status MakeEmptyFolder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) &&
      (!fs::is_directory(folder, error) || !fs::is_empty(folder, error))) {
    return Status::AlreadyExists(folder.string() +
                                 " is there and not an empty folder; name a new one");
  }
  for (const fs::path& part : {folder / "photos", folder / "truth"}) {
    fs::create_directories(part, error);
    if (error) return Status::IoError("cannot make " + part.string() + ": " + error.message());
  }
  return {};
}

Status Close(std::ofstream* file, const fs::path& path) {
  file->close();
  return *file ? Status::Ok() : Status::IoError("cannot write " + path.string());
}

Status WriteJpeg(const cv::Mat& photo, int quality, const fs::path& path) {
  std::vector<uint8_t> jpeg;
  if (!cv::imencode(".jpg", photo, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality})) {
    return Status::IoError("cannot encode " + path.string());
  }
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(jpeg.data()), static_cast<std::streamsize>(jpeg.size()));
  return Close(&file, path);
}

Status WriteTruth(const Floor& floor, const FloorCamera& camera, const fs::path& folder) {
  const std::string path = (folder / (camera.name + ".camera")).string();
  VEDUTA_RETURN_IF_ERROR(
      street::WriteCameraFile({camera.name, camera.model, camera.cam_from_world}, path));
  const fs::path markers_path = folder / (camera.name + ".markers");
  std::ofstream file(markers_path);
  file << std::setprecision(12);
  for (const MarkerTruth& truth : TrueMarkers(floor, camera)) {
    file << truth.id << " " << truth.px.x() << " " << truth.px.y() << " " << truth.diameter_px
         << " " << truth.tilt_deg << " " << truth.cover << " " << truth.is_whole << "\n";
  }
  return Close(&file, markers_path);
}

Status WriteAbout(const Floor& floor, const SessionOptions& options, const fs::path& folder) {
  VEDUTA_RETURN_IF_ERROR(
      street::WriteIntrinsicsFile(options.model, (folder / "camera.txt").string()));
  std::ofstream markers(folder / "markers.txt");
  markers << std::setprecision(12);
  for (const FloorMarker& marker : floor.markers()) {
    markers << marker.id << " " << marker.center_m.x() << " " << marker.center_m.y() << " "
            << marker.center_m.z() << "\n";
  }
  VEDUTA_RETURN_IF_ERROR(Close(&markers, folder / "markers.txt"));
  std::ofstream readme(folder / "README");
  readme << "A calibration session by veduta-floor " << options.command << "\n\n"
         << "photos/NAME          " << options.photos
         << " photos of markers on a floor, all by one camera\n"
         << "camera.txt           its intrinsics, px, (0, 0) is the centre of the top-left pixel; "
            "distortion\n"
         << "                     x_d = c + (x - c)(1 + k1 r^2 + k2 r^4) in normalised "
            "coordinates, c at (u0, v0) px\n"
         << "markers.txt          id and true place in metres (x y z) of every marker\n"
         << "truth/NAME.camera    K (3 rows), zeros, R camera-to-world (3 rows), camera centre in "
            "metres, size\n"
         << "truth/NAME.markers   id, true u v, diameter (px), tilt (degrees), covered part, 1 if "
            "wholly in the photo\n";
  return Close(&readme, folder / "README");
}

}  // namespace

Status SessionOptions::Check() const {
  VEDUTA_RETURN_IF_ERROR(floor.Check());
  VEDUTA_RETURN_IF_ERROR(photo.Check());
  const struct {
    const char* name;
    double value, low, high;
  } bounds[] = {{"photos", static_cast<double>(photos), 1, 1000},
                {"tilt_deg_max", tilt_deg_max, 0, 75},
                {"coverage", coverage, 0.1, 5},
                {"motion_px_max", motion_px_max, 0, 100},
                {"blur_sigma_px_max", blur_sigma_px_max, 0, 20},
                {"jpeg_quality", jpeg_quality * 1.0, 1, 100},
                {"threads", static_cast<double>(threads), 1, 256}};
  for (const auto& bound : bounds) {
    if (!(bound.value >= bound.low && bound.value <= bound.high)) {
      return Status::InvalidArgument(std::string(bound.name) + " = " + std::to_string(bound.value) +
                                     " is not in [" + std::to_string(bound.low) + ", " +
                                     std::to_string(bound.high) + "]");
    }
  }
  return Status::Ok();
}

Rigid3 LookDown(const Eigen::Vector2d& target_m, double distance_m, double tilt_deg,
                double azimuth_deg, double roll_deg) {
  const double tilt = tilt_deg * kRadPerDeg, azimuth = azimuth_deg * kRadPerDeg;
  const Eigen::Vector3d back(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                             std::cos(tilt));
  const Eigen::Vector3d center = Eigen::Vector3d(target_m.x(), target_m.y(), 0) + distance_m * back;
  const Eigen::Vector3d right(-std::sin(azimuth), std::cos(azimuth), 0);
  Eigen::Matrix3d cam_from_world;
  cam_from_world << right.transpose(), (-back).cross(right).transpose(), (-back).transpose();
  Rigid3 pose;
  pose.rotation = Eigen::AngleAxisd(roll_deg * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
                  Eigen::Quaterniond(cam_from_world);
  pose.translation = -(pose.rotation * center);
  return pose;
}

Result<std::vector<FloorCamera>> SessionCameras(const SessionOptions& options,
                                                double floor_extent_m) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  SeededRandom random(MixSeed(options.seed, 11));
  std::vector<FloorCamera> cameras;
  for (uint32_t i = 0; i < options.photos; ++i) {
    // Around the floor in steps of the golden angle; tilts spread evenly, in an order that mixes
    // them.
    const double spread = options.photos == 1
                              ? 0
                              : static_cast<double>(i * 7 % options.photos) / (options.photos - 1);
    const double tilt_deg = options.tilt_deg_max * (0.05 + 0.95 * std::min(spread, 1.0));
    const double width_m = options.coverage * 2 * floor_extent_m * (0.75 + 0.4 * random.Unit());
    const double distance_m = width_m * options.model.fx / options.model.width_px;
    const Eigen::Vector2d target_m =
        0.3 * floor_extent_m * Eigen::Vector2d(2 * random.Unit() - 1, 2 * random.Unit() - 1);
    char name[32];
    std::snprintf(name, sizeof name, "photo%04u.jpg", i + 1);
    cameras.push_back({name, options.model,
                       LookDown(target_m, distance_m, tilt_deg, 137.50776 * i + 20 * random.Unit(),
                                90.0 * random.Below(4) + 30 * (random.Unit() - 0.5))});
  }
  return cameras;
}

Result<cv::Mat> RenderSessionPhoto(const Floor& floor, const FloorCamera& camera,
                                   const SessionOptions& options, size_t index) {
  FloorPhotoOptions photo = options.photo;
  photo.seed = MixSeed(options.photo.seed, index);
  SeededRandom random(MixSeed(photo.seed, 12));
  photo.motion_px = std::min(photo.motion_px + options.motion_px_max * random.Unit(), 100.0);
  photo.motion_deg += 180 * random.Unit();
  photo.blur_sigma_px =
      std::min(photo.blur_sigma_px + options.blur_sigma_px_max * random.Unit(), 20.0);
  return RenderFloorPhoto(floor, camera, photo);
}

Status RenderSession(const SessionOptions& options, const std::string& folder,
                     const std::function<void(size_t)>& progress) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_ASSIGN_OR_RETURN(const Floor floor, Floor::Build(options.floor));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<FloorCamera> cameras,
                          SessionCameras(options, floor.extent_m()));
  const fs::path out = folder;
  VEDUTA_RETURN_IF_ERROR(MakeEmptyFolder(out));
  VEDUTA_RETURN_IF_ERROR(WriteAbout(floor, options, out));
  const auto render_one = [&](size_t i) -> Status {
    VEDUTA_ASSIGN_OR_RETURN(const cv::Mat photo, RenderSessionPhoto(floor, cameras[i], options, i));
    VEDUTA_RETURN_IF_ERROR(
        WriteJpeg(photo, options.jpeg_quality, out / "photos" / cameras[i].name));
    return WriteTruth(floor, cameras[i], out / "truth");
  };
  ThreadPool pool(options.threads - 1);
  std::mutex mutex;
  std::vector<Status> outcomes(cameras.size());
  size_t done = 0;
  pool.ParallelFor(cameras.size(), [&](size_t i) {
    outcomes[i] = render_one(i);
    const std::lock_guard lock(mutex);
    ++done;
    if (progress) progress(done);
  });
  for (Status& outcome : outcomes) VEDUTA_RETURN_IF_ERROR(std::move(outcome));
  return {};
}

}  // namespace veduta::floor
