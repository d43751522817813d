// SPDX-License-Identifier: Apache-2.0
// veduta-street: renders photos of a street that never was, with the truth about each.
// Exit codes: 0 done; 1 it could not be done; 2 bad usage.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <string>

#include "tools/render/street/data_set.h"
#include "tools/render/street/truth_file.h"

namespace veduta::street {
namespace {

struct Arguments {
  std::string folder, size = "1024x768", trajectory = "street", shuffle = "no",
                      twin_facades = "none";
  uint32_t photos = 0, threads = 1;
  uint64_t seed = 1;
  double length_m = 0, focal_px = 0, k1 = 0, k2 = 0, position_jitter_m = 0.15,
         angle_jitter_deg = 2.5;
  double u0 = 0, v0 = 0;
  bool has_u0 = false, has_v0 = false, repeated_windows = false, no_bridge = false, depth = false,
       mesh = false;
  bool quiet = false;
  double gps_m = 0;
  RenderOptions render;
  int jpeg_quality = 92;
};

constexpr double kDefaultLengthM = 60;
constexpr uint32_t kDefaultPhotos = 72;

Result<DataSetOptions> MakeOptions(const Arguments& arguments) {
  static const std::map<std::string, Trajectory> trajectories = {
      {"street", Trajectory::kStreet},
      {"loop", Trajectory::kLoop},
      {"orbit", Trajectory::kOrbit},
      {"two-sites", Trajectory::kTwoSites}};
  static const std::map<std::string, TwinFacades> twins = {{"none", TwinFacades::kNone},
                                                           {"near", TwinFacades::kNear},
                                                           {"far", TwinFacades::kFar},
                                                           {"ends", TwinFacades::kEnds}};
  DataSetOptions options;
  CameraModel& model = options.rig.model;
  char rest = 0;
  if (std::sscanf(arguments.size.c_str(), "%5ux%5u%c", &model.width_px, &model.height_px, &rest) !=
      2) {
    return Status::InvalidArgument("--size " + arguments.size + " is not WIDTHxHEIGHT");
  }
  model.fx = model.fy = arguments.focal_px > 0 ? arguments.focal_px : 0.88 * model.width_px;
  model.cx = (model.width_px - 1.0) / 2;
  model.cy = (model.height_px - 1.0) / 2;
  model.k1 = arguments.k1;
  model.k2 = arguments.k2;
  model.u0 = arguments.has_u0 ? arguments.u0 : model.cx;
  model.v0 = arguments.has_v0 ? arguments.v0 : model.cy;
  options.rig.trajectory = trajectories.at(arguments.trajectory);
  // Length and number follow each other unless both are given.
  uint32_t photos = arguments.photos;
  if (photos == 0) {
    const bool walk = options.rig.trajectory == Trajectory::kStreet && arguments.length_m > 0;
    photos = walk ? static_cast<uint32_t>(arguments.length_m * kDefaultPhotos / kDefaultLengthM)
                  : kDefaultPhotos;
  }
  options.rig.photos = photos;
  options.rig.shuffle = arguments.shuffle == "yes";
  options.rig.bridge = !arguments.no_bridge;
  options.rig.position_jitter_m = arguments.position_jitter_m;
  options.rig.angle_jitter_deg = arguments.angle_jitter_deg;
  options.rig.seed = options.render.seed = arguments.seed;
  options.scene = SceneForTrajectory(options.rig.trajectory, photos, arguments.length_m);
  options.scene.seed = arguments.seed;
  options.scene.repeated_windows = arguments.repeated_windows;
  options.scene.twin_facades = twins.at(arguments.twin_facades);
  options.render = arguments.render;
  options.render.seed = arguments.seed;
  options.render.depth = arguments.depth;
  options.jpeg_quality = arguments.jpeg_quality;
  options.mesh = arguments.mesh;
  options.gps_m = arguments.gps_m;
  options.threads = arguments.threads;
  VEDUTA_RETURN_IF_ERROR(options.Check());
  return options;
}

void AddCommandLine(CLI::App& app, Arguments& a) {
  app.add_option("OUT", a.folder, "a new or empty folder")->required();
  app.add_option("--photos", a.photos, "how many photos (72; or from --length)")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--length", a.length_m,
                 "metres of street (from --photos: 60 for 72; over 400: a grid of streets)")
      ->check(CLI::Range(10.0, 20000.0));
  app.add_option("--trajectory", a.trajectory, "street, loop, orbit or two-sites")
      ->check(CLI::IsMember({"street", "loop", "orbit", "two-sites"}));
  app.add_flag("--no-bridge", a.no_bridge, "two-sites: without the photos that join the sites");
  app.add_option("--shuffle", a.shuffle, "names in random order: yes or no")
      ->check(CLI::IsMember({"yes", "no"}));
  app.add_flag("--repeated-windows", a.repeated_windows, "all facades repeat every 3 m");
  app.add_option("--twin-facades", a.twin_facades,
                 "places that look alike but for signs, trees, cars and neighbours: near each "
                 "other, far, at both ends of a loop, or none")
      ->check(CLI::IsMember({"none", "near", "far", "ends"}));
  app.add_option("--size", a.size, "WIDTHxHEIGHT in px (1024x768)");
  app.add_option("--focal", a.focal_px, "focal length in px (0.88 of the width)")
      ->check(CLI::Range(10.0, 100000.0));
  app.add_option("--k1", a.k1, "radial distortion x_d = c + (x - c)(1 + k1 r^2 + k2 r^4)")
      ->check(CLI::Range(-2., 2.));
  app.add_option("--k2", a.k2, "see --k1")->check(CLI::Range(-2.0, 2.0));
  app.add_option("--u0", a.u0, "centre of distortion in px (the picture's centre)");
  app.add_option("--v0", a.v0, "see --u0");
  app.add_option("--noise", a.render.noise_sigma, "grey levels (0)")->check(CLI::Range(0.0, 64.0));
  app.add_option("--blur", a.render.blur_sigma_px, "sigma in px (0)")->check(CLI::Range(0.0, 20.0));
  app.add_option("--exposure", a.render.exposure_stops,
                 "random exposure and white balance, stops (0)")
      ->check(CLI::Range(0.0, 4.0));
  app.add_option("--supersample", a.render.supersample,
                 "rays a pixel each way; 1: more at edges only (1)")
      ->check(CLI::Range(1, 8));
  app.add_option("--position-jitter", a.position_jitter_m, "metres (0.15)")
      ->check(CLI::Range(0.0, 0.5));
  app.add_option("--angle-jitter", a.angle_jitter_deg, "degrees (2.5)")
      ->check(CLI::Range(0.0, 20.0));
  app.add_option("--jpeg-quality", a.jpeg_quality, "1 to 100 (92)")->check(CLI::Range(1, 100));
  app.add_option("--seed", a.seed, "of everything (1)");
  app.add_option("--threads", a.threads, "one photo per thread (1)")->check(CLI::Range(1, 256));
  app.add_flag("--depth", a.depth, "with truth/NAME.depth");
  app.add_flag("--mesh", a.mesh, "with scene.ply");
  app.add_option("--gps", a.gps_m, "EXIF with GPS of this standard deviation, metres (0: none)")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_flag("--quiet", a.quiet, "no progress on standard error");
}

int Run(int argc, char** argv) {
  CLI::App app("Photos of a synthetic street, with their truth");
  Arguments arguments;
  AddCommandLine(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  arguments.has_u0 = app.count("--u0") > 0;
  arguments.has_v0 = app.count("--v0") > 0;
  Result<DataSetOptions> options = MakeOptions(arguments);
  if (!options.ok()) {
    std::fprintf(stderr, "veduta-street: %s\n", options.status().message().c_str());
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    if (argv[i] != arguments.folder)
      options->command += std::string(options->command.empty() ? "" : " ") + argv[i];
  }
  const size_t total = options->rig.photos;
  const auto progress = [&](size_t done) {
    if (!arguments.quiet && (done % 100 == 0 || done == total))
      std::fprintf(stderr, "%zu/%zu photos\n", done, total);
  };
  const Status status = RenderStreet(*options, arguments.folder, progress);
  if (status.ok()) {
    std::printf("%s: %zu photos; --size %ux%u --params %s\n", arguments.folder.c_str(), total,
                options->rig.model.width_px, options->rig.model.height_px,
                CameraParams(options->rig.model).c_str());
    return 0;
  }
  std::fprintf(stderr, "veduta-street: %s\n", status.message().c_str());
  return status.code() == StatusCode::kInvalidArgument ? 2 : 1;
}

}  // namespace
}  // namespace veduta::street

int main(int argc, char** argv) {
  return veduta::street::Run(argc, argv);
}
