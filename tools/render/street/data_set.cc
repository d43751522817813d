// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/data_set.h"

#include <filesystem>
#include <fstream>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "storage/base/thread_pool.h"
#include "tools/render/street/gps_tags.h"
#include "tools/render/street/truth_file.h"
#include "tools/render/street/twin_facades.h"

namespace veduta::street {
namespace {

namespace fs = std::filesystem;

Status MakeEmptyFolder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) {
    return Status::AlreadyExists(folder.string() + " exists and is not a folder");
  }
  if (fs::is_directory(folder, error) && !fs::is_empty(folder, error)) {
    return Status::AlreadyExists(folder.string() + " is not empty; name a new folder");
  }
  for (const fs::path& part : {folder / "photos", folder / "truth"}) {
    fs::create_directories(part, error);
    if (error) return Status::IoError("cannot make " + part.string() + ": " + error.message());
  }
  return {};
}

Status WriteBytes(const std::vector<uint8_t>& bytes, const fs::path& path) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) return Status::IoError("cannot write " + path.string());
  return {};
}

// Which facades are alike, for whoever asks what misled a reconstruction.
void WriteTwins(const SceneOptions& options, std::ostream& out) {
  const Plan plan = MakePlan(options);
  if (plan.twins.empty()) return;
  out << "\nThe facades of these places are exactly alike, signs and posters excepted. Trees, "
         "cars,\n"
         "pavements and neighbours differ. PAIR, the place's length in metres, x and y of its "
         "middle:\n";
  for (const TwinPlace& place : plan.twins) {
    const Eigen::Vector2d middle = MiddleOf(place, plan);
    out << place.pair << " " << place.length_m << " " << middle.x() << " " << middle.y() << "\n";
  }
}

Status WriteReadme(const DataSetOptions& options, const fs::path& path) {
  std::ofstream file(path);
  file << "A synthetic street by veduta-street"
       << (options.command.empty() ? "" : ": " + options.command) << "\n\n"
       << "photos/NAME         " << options.rig.photos << " photos, " << options.rig.model.width_px
       << "x" << options.rig.model.height_px << ", all by one camera\n"
       << "camera.txt          its intrinsics, px, (0, 0) is the centre of the top-left pixel; "
          "distortion\n"
       << "                    x_d = c + (x - c)(1 + k1 r^2 + k2 r^4) in normalised coordinates, c "
          "at (u0, v0) px;\n"
       << "                    PARAMS is what `veduta camera add --params` takes\n"
       << "truth/NAME.camera   K of the SAME size as the photo (3 rows), zeros, R camera-to-world "
          "(3 rows),\n"
       << "                    camera centre in metres, size; world z up\n";
  if (options.render.depth) {
    file << "truth/NAME.depth    \"VDP1\", uint32 width, uint32 height, float32 depth along the "
            "camera's z in metres,\n"
         << "                    row by row for the pixels of the (distorted) photo, 0 for sky; "
            "little-endian\n";
  }
  if (options.mesh) file << "scene.ply           the geometry, metres\n";
  if (options.gps_m > 0) {
    file << "EXIF's GPS has errors of " << options.gps_m
         << " m along each axis, of twice that in height; (0, 0, 0) is at latitude "
         << kStreetOrigin.latitude_deg << ", longitude " << kStreetOrigin.longitude_deg
         << ", height " << kStreetOrigin.height_m << " m, x is east there and y north\n";
  }
  WriteTwins(options.scene, file);
  file << "\nScore a reconstruction: score_poses.py truth OUT/<reconstruction>/images.txt\n";
  file.close();
  if (!file) return Status::IoError("cannot write " + path.string());
  return {};
}

Status RenderOne(const Scene& scene, const StreetCamera& camera, const DataSetOptions& options,
                 size_t index, const fs::path& folder) {
  RenderOptions render = options.render;
  render.seed = MixSeed(options.render.seed, index);
  VEDUTA_ASSIGN_OR_RETURN(const StreetPhoto photo, RenderPhoto(scene, camera, render));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<uint8_t> jpeg, EncodeJpeg(photo, options.jpeg_quality));
  if (options.gps_m > 0) {
    const Eigen::Vector3d received =
        ReceivedPosition(camera.cam_from_world.Center(), options.gps_m, options.render.seed, index);
    VEDUTA_ASSIGN_OR_RETURN(jpeg, WithGpsTags(jpeg, FixAt(received, options.gps_m)));
  }
  VEDUTA_RETURN_IF_ERROR(WriteBytes(jpeg, folder / "photos" / camera.name));
  VEDUTA_RETURN_IF_ERROR(
      WriteCameraFile(camera, (folder / "truth" / (camera.name + ".camera")).string()));
  if (!render.depth) return {};
  return WriteDepthFile(photo, (folder / "truth" / (camera.name + ".depth")).string());
}

}  // namespace

Status DataSetOptions::Check() const {
  VEDUTA_RETURN_IF_ERROR(scene.Check());
  VEDUTA_RETURN_IF_ERROR(rig.Check());
  VEDUTA_RETURN_IF_ERROR(render.Check());
  if (jpeg_quality < 1 || jpeg_quality > 100) {
    return Status::InvalidArgument("JPEG quality " + std::to_string(jpeg_quality) +
                                   " is outside [1, 100]");
  }
  if (!(gps_m >= 0 && gps_m <= 1000))
    return Status::InvalidArgument("GPS of " + std::to_string(gps_m) + " m is outside [0, 1000]");
  if (threads < 1 || threads > 256) {
    return Status::InvalidArgument("threads " + std::to_string(threads) + " is outside [1, 256]");
  }
  return {};
}

Result<std::vector<uint8_t>> EncodeJpeg(const StreetPhoto& photo, int quality) {
  const size_t pixels = size_t{photo.width_px} * photo.height_px;
  if (pixels == 0 || photo.rgb.size() != pixels * 3)
    return Status::InvalidArgument("no picture to encode");
  // OpenCV wants blue first.
  std::vector<uint8_t> bgr(photo.rgb.size());
  for (size_t i = 0; i < bgr.size(); i += 3) {
    bgr[i] = photo.rgb[i + 2];
    bgr[i + 1] = photo.rgb[i + 1];
    bgr[i + 2] = photo.rgb[i];
  }
  const cv::Mat image(static_cast<int>(photo.height_px), static_cast<int>(photo.width_px), CV_8UC3,
                      bgr.data());
  std::vector<uint8_t> jpeg;
  try {
    if (!cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality})) {
      return Status::IoError("the JPEG encoder gave nothing");
    }
  } catch (const cv::Exception& error) {
    return Status::IoError(std::string("the JPEG encoder failed: ") + error.what());
  }
  return jpeg;
}

Status RenderStreet(const DataSetOptions& options, const std::string& folder,
                    const std::function<void(size_t)>& progress) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<StreetCamera> cameras,
                          MakeCameras(options.scene, options.rig));
  VEDUTA_RETURN_IF_ERROR(MakeRayTable(options.rig.model).status());  // before anything is written
  const fs::path out = folder;
  VEDUTA_RETURN_IF_ERROR(MakeEmptyFolder(out));
  SceneOptions scene_options = options.scene;
  scene_options.build_threads = options.threads;
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Scene> scene, BuildScene(scene_options));
  VEDUTA_RETURN_IF_ERROR(WriteIntrinsicsFile(options.rig.model, (out / "camera.txt").string()));
  VEDUTA_RETURN_IF_ERROR(WriteReadme(options, out / "README"));
  if (options.mesh) VEDUTA_RETURN_IF_ERROR(WriteMesh(*scene, (out / "scene.ply").string()));

  ThreadPool pool(options.threads - 1);
  std::mutex mutex;
  Status failure;
  size_t done = 0;
  pool.ParallelFor(cameras.size(), [&](size_t i) {
    {
      const std::lock_guard lock(mutex);
      if (!failure.ok()) return;
    }
    Status status = RenderOne(*scene, cameras[i], options, i, out);
    const std::lock_guard lock(mutex);
    if (!status.ok() && failure.ok()) failure = std::move(status);
    ++done;
    if (progress) progress(done);
  });
  return failure;
}

}  // namespace veduta::street
