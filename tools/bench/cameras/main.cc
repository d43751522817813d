// SPDX-License-Identifier: Apache-2.0
// veduta-strange-cameras: photos of one known camera as several unknown ones would have taken them:
// smaller, cropped off their middle, and distorted. They tell nothing of their cameras, which are
// printed.
// Exit codes: 0 done; 1 it could not be done; 2 bad usage.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "engine/camera/projection.h"
#include "engine/door/calibration.h"
#include "storage/base/content_hash.h"
#include "tools/bench/orders/order_list.h"

namespace veduta {
namespace {

// Of each side of a photo, what stays: a photo that is wider bent needs what lies beside it.
constexpr double kKept = 0.82;
// Any number would do.
constexpr uint64_t kSeedOfCameras = 3;
constexpr double kBentMin = -0.15, kBentMax = 0.1;

struct Arguments {
  std::string photos, out, size, params;
  uint64_t seed = 1;
  uint32_t cameras = 4;
  double scale_min = 0.4, scale_max = 0.9, off_middle = 0.08;
};

double Between(double low, double high, SeededRandom* random) {
  return low + (high - low) * random->Unit();
}

CameraModel Draw(const CameraModel& source, const Arguments& arguments, SeededRandom* random) {
  const double scale = Between(arguments.scale_min, arguments.scale_max, random);
  CameraModel camera;
  camera.width_px = static_cast<uint32_t>(kKept * scale * source.width_px);
  camera.height_px = static_cast<uint32_t>(kKept * scale * source.height_px);
  camera.fx = scale * source.fx, camera.fy = scale * source.fy;
  const double off = arguments.off_middle;
  const double left = (1 - kKept) / 2 + Between(-off, off, random);
  const double above = (1 - kKept) / 2 + Between(-off, off, random);
  camera.cx = scale * (source.cx + 0.5 - left * source.width_px) - 0.5;
  camera.cy = scale * (source.cy + 0.5 - above * source.height_px) - 0.5;
  camera.u0 = camera.cx, camera.v0 = camera.cy;
  camera.k1 = Between(kBentMin, kBentMax, random);
  return camera;
}

// Where each pixel of the camera's photo lies in the source's.
Status Map(const CameraModel& source, const CameraModel& camera, cv::Mat* x, cv::Mat* y) {
  x->create(static_cast<int>(camera.height_px), static_cast<int>(camera.width_px), CV_32F);
  y->create(x->size(), CV_32F);
  for (int v = 0; v < x->rows; ++v) {
    for (int u = 0; u < x->cols; ++u) {
      const auto straight =
          UndistortPixel(camera, {static_cast<double>(u), static_cast<double>(v)});
      const auto px =
          straight ? PixelFromBearing(source, BearingFromPixel(camera, *straight)) : std::nullopt;
      if (!px) return Status::InvalidArgument("a lens was drawn that bends more than a photo has");
      x->at<float>(v, u) = static_cast<float>(px->x());
      y->at<float>(v, u) = static_cast<float>(px->y());
    }
  }
  return Status::Ok();
}

Status Take(const orders::OrderedPhoto& photo, const CameraModel& source, const CameraModel& camera,
            const cv::Mat& x, const cv::Mat& y, const std::string& out) {
  cv::Mat picture = cv::imread(photo.path, cv::IMREAD_COLOR);
  if (picture.cols != static_cast<int>(source.width_px) ||
      picture.rows != static_cast<int>(source.height_px))
    return Status::InvalidArgument(photo.path + " is no picture of the size of the camera");
  const double scale = camera.fx / source.fx;
  // What is smaller shows less detail, and no false patterns.
  cv::GaussianBlur(picture, picture, {}, 0.45 / scale);
  cv::Mat taken;
  cv::remap(picture, taken, x, y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  const std::string path = out + "/" + photo.name;
  if (!cv::imwrite(path, taken, {cv::IMWRITE_JPEG_QUALITY, 95}))
    return Status::IoError(path + " cannot be written");
  return Status::Ok();
}

Status TakeAll(const Arguments& arguments) {
  VEDUTA_ASSIGN_OR_RETURN(const CameraModel source, ParseCamera(arguments.size, arguments.params));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<orders::OrderedPhoto> photos,
                          orders::ListFolder(arguments.photos));
  std::filesystem::create_directories(arguments.out);
  // Mixed, for seeds that are close together would draw the same cameras at other places.
  SeededRandom random(MixSeed(arguments.seed, kSeedOfCameras));
  for (uint32_t c = 0; c < arguments.cameras; ++c) {
    const CameraModel camera = Draw(source, arguments, &random);
    cv::Mat x, y;
    VEDUTA_RETURN_IF_ERROR(Map(source, camera, &x, &y));
    size_t count = 0;
    for (size_t i = c; i < photos.size(); i += arguments.cameras, ++count)
      VEDUTA_RETURN_IF_ERROR(Take(photos[i], source, camera, x, y, arguments.out));
    std::printf("%zu photos of %ux%u: %s\n", count, camera.width_px, camera.height_px,
                CameraParamsText(camera).c_str());
  }
  return Status::Ok();
}

int Run(int argc, char** argv) {
  CLI::App app("Photos as several strange cameras would have taken them");
  Arguments arguments;
  app.add_option("PHOTOS", arguments.photos, "a folder of photos that one camera took")->required();
  app.add_option("OUT", arguments.out, "the folder to write to")->required();
  app.add_option("--size", arguments.size, "WIDTHxHEIGHT of that camera in px")->required();
  app.add_option("--params", arguments.params, "its fx,fy,cx,cy")->required();
  app.add_option("--seed", arguments.seed, "of the cameras that are drawn (1)");
  app.add_option("--cameras", arguments.cameras, "so many, photo after photo in turn (4)")
      ->check(CLI::Range(1, 1000));
  app.add_option("--scale-min", arguments.scale_min, "the smallest photo over the known ones (0.4)")
      ->check(CLI::Range(0.1, 1.0));
  app.add_option("--scale-max", arguments.scale_max, "the largest photo over the known ones (0.9)")
      ->check(CLI::Range(0.1, 1.0));
  app.add_option("--off-middle", arguments.off_middle,
                 "how far from the middle it is cut out at most, over the known side (0.08)")
      ->check(CLI::Range(0.0, 0.09));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const Status done = TakeAll(arguments);
  if (done.ok()) return 0;
  std::fprintf(stderr, "veduta-strange-cameras: %s\n", done.message().c_str());
  return done.code() == StatusCode::kInvalidArgument ? 2 : 1;
}

}  // namespace
}  // namespace veduta

int main(int argc, char** argv) {
  return veduta::Run(argc, argv);
}
